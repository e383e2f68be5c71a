"""OpenDRIVE elements to models: a module for each kind of element.

Readers take lxml elements, return models, and repair faulty elements in the tree. The repaired
tree is the file as the reader understands it; `opendrive.document.write` writes it.
"""
