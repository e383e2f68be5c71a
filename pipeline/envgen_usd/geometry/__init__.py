"""Geometry that several layers share: polygons, rings, triangulation."""
