"""Street networks in plan, and the OpenDRIVE roads and junctions that they become."""
