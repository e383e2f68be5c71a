"""Terrain from the road surface: height maps, and a ground mesh stitched to the road."""
