"""Smooths staircases between landuse classes by cutting the corners of cells."""

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS
from envgen_usd.models.array_types import BoolArray, IntArray

CORNERS = ((-1, -1), (-1, 1), (1, 1), (1, -1))
"""(row, column) steps towards the corners of a cell: south-west, south-east, north-east,
north-west."""


def cut_corners(classes: IntArray) -> tuple[IntArray, IntArray]:
    """Selects the cells in which half of the area takes the neighbours' class.

    A staircase step has an outer corner on either side; the corner of the higher class is cut.
    There, both adjacent cells have the same lower class, and both opposite cells have the class of
    the cell itself. Cells with several such corners and cells at the chunk's border stay whole.

    Args:
        classes: 255 x 255, numbers of the ground's landuse (`LanduseMap.looks`).

    Returns:
        Cut corner of each cell, 255 x 255, index into `CORNERS` or -1. Cell (row * 255 + column)
        with the landuse of that half, 255 x 255.
    """
    corner = np.full(classes.shape, -1, dtype=np.int64)
    taken = np.zeros(classes.shape, dtype=np.int64)
    count = np.zeros(classes.shape, dtype=np.int64)
    number = np.arange(classes.size).reshape(classes.shape)
    for index, (row, column) in enumerate(CORNERS):
        cut = _cut(classes, row, column)
        corner[cut], count[cut] = index, count[cut] + 1
        taken[cut] = number[cut] + row * LANDUSE_CELLS
    corner[count > 1] = -1
    return corner, taken


def _cut(classes: IntArray, row: int, column: int) -> BoolArray:
    """Returns the cells with a cut corner in a direction."""
    beside, opposite = (np.roll(classes, -step, axis=1) for step in (column, -column))
    ahead, behind = (np.roll(classes, -step, axis=0) for step in (row, -row))
    cut: BoolArray = (beside == ahead) & (beside < classes)
    cut &= (opposite == classes) & (behind == classes)
    cut[[0, -1]] = False
    cut[:, [0, -1]] = False
    return cut
