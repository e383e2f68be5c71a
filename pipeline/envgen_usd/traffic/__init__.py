"""Actors: where vehicles and people stand, and how they move."""
