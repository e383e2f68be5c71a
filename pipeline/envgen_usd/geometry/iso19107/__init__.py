"""Validity of polygons and solids after ISO 19107, with the error codes of val3dity."""
