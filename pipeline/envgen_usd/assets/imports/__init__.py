"""Files of other programs, as meshes and materials before they become an asset."""
