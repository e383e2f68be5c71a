"""Plots and environment profile to a semantic city model."""
