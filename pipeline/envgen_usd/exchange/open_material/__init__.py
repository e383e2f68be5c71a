"""ASAM OpenMATERIAL 3D 1.1: what the materials of a stage are to sensors."""
