"""The passes of a frame in order: labels, depth, normals, colour, edges; the views of a lens."""
