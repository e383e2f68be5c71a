"""Geometry of roads: plan view, lateral profile, road frame, lane borders, sampling."""
