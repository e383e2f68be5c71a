"""Procedural textures of the library's materials."""
