"""Frozen models that connect the layers; they are independent of file formats."""
