"""Checks of a whole network: references between its elements, and bounds of their values."""
