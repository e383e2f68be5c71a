"""Composed stage to camera and label images."""
