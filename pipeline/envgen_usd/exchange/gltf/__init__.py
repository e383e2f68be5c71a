"""glTF 2.0: the container, accessors, materials, and a chunk as a document."""
