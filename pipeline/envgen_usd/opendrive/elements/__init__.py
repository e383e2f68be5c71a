"""OpenDRIVE elements to models: one module for each kind of element.

Every reader here takes lxml elements, returns models, and mends the elements in place where it has
to, so that the tree that is left is the file as it was understood (`opendrive.write` writes it).
"""
