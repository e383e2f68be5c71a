"""Lanelet2 maps of real places."""
