"""Learned landuse: a mask-aware transformer for class maps, its data, training and sampling."""
