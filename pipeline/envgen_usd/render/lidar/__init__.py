"""Scans of spinning lidars: patterns, the tree of what stands still, returns, files."""
