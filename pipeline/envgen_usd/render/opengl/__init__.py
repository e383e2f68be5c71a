"""OpenGL: context, programs, textures, and the draws of a packed scene."""
