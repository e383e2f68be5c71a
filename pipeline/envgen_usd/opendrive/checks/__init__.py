"""Checks of a whole network: what its elements say about each other."""
