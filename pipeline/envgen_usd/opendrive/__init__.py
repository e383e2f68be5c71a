"""OpenDRIVE file to road network, and road network to one watertight road surface."""
