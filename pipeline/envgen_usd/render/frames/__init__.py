"""Frames on disk: their export, folders, light, label images and rig; and their reader."""
