"""Layout of the arrays on the GPU: vertices, groups of merged meshes, instances, draw commands."""

from typing import NamedTuple

import numpy as np

VERTEX = np.dtype(
    [
        ("position", "<f4", 3),
        ("normal", "<i2", 4),
        ("uv", "<f4", 2),
        ("colour", "u1", 4),
        ("scene_object", "<u4"),
    ]
)
GROUP = np.dtype(
    [
        ("double_sided", "<i4"),
        ("material", "<i4"),
        ("cell", "<i8", 2),
        ("vertices", "<i8"),
        ("corners", "<i8"),
        ("box", "<f8", (2, 3)),
    ]
)
"""Merged triangles of a look and a tile: cell of the tile along x and y, numbers of vertices and of
corners, minimum and maximum corner in the world."""
INSTANCE = np.dtype(
    [("rows", "<f4", (3, 4)), ("scene_object", "<u4"), ("tile", "<u4"), ("number", "<u4")]
)
COMMAND = np.dtype(
    [
        ("count", "<u4"),
        ("instances", "<u4"),
        ("first_index", "<u4"),
        ("base_vertex", "<i4"),
        ("base_instance", "<u4"),
    ]
)
"""Layout of OpenGL's DrawElementsIndirectCommand."""


class State(NamedTuple):
    """State of a draw; draws with equal states share a call."""

    double_sided: bool
    mirrored: bool
    material: int
