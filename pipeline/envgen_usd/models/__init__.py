"""Frozen models that the layers hand to one another; they know no file."""
