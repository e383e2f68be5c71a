"""Geometry shared by several layers: polygons, rings, triangulation, georeferences."""
