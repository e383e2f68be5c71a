"""Blocks as a whole: street fronts, corners, inner plots at lanes, and what is left over."""
