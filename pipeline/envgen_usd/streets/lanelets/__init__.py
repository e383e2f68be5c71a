"""Lanelets as OpenDRIVE."""
