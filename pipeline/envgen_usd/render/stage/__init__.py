"""From a composed stage to a `Scene`: prims, meshes, materials, lamps, lanes, sun and sky."""
