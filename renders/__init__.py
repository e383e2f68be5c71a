"""Camera rigs, shaders and sky presets."""
