"""A map for CARLA: meshes with the names that its import reads, the road, and the package file."""
