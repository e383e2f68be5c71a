"""Vehicles of the shipped library: lofted bodies, wheels, lamps and plates."""
