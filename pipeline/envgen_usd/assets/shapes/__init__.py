"""Geometry of the library's assets."""
