"""Cameras: rigs, lenses, poses, clearance, and the camera's response to light and rain."""
