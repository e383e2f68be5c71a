"""Asset library: environments, assets, materials and textures."""
