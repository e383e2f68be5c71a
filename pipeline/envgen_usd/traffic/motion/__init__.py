"""The motion of actors on the surface of a map, and what is in their way."""
