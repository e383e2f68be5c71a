"""ASAM OpenDRIVE: from a file to a road network, and from a network to a road surface."""
