"""Smooths the staircases between landuse classes by cutting the corners of cells."""

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS
from envgen_usd.models.arrays import BoolArray, ByteArray, IntArray

CORNERS = ((-1, -1), (-1, 1), (1, 1), (1, -1))
"""(row, column) steps towards the corners of a cell: south-west, south-east, north-east,
north-west."""


def cut_corners(classes: ByteArray) -> tuple[IntArray, IntArray]:
    """Finds the cells of which one half belongs to the neighbours' class.

    A step of a staircase has an outer corner on either side; one of them, that of the higher
    class, is cut. It is there where both neighbours at it have one lower class, and the two
    opposite ones the cell's own. A cell with more than one such corner is left whole, and so are
    those at the chunk's border.

    Args:
        classes: 255 x 255, classes of the ground.

    Returns:
        255 x 255, index into `CORNERS` of the corner that is cut, -1 for none; 255 x 255, the
        cell (row * 255 + column) whose landuse that half takes.
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


def _cut(classes: ByteArray, row: int, column: int) -> BoolArray:
    """Cells whose corner in one direction is cut."""
    beside, opposite = (np.roll(classes, -step, axis=1) for step in (column, -column))
    ahead, behind = (np.roll(classes, -step, axis=0) for step in (row, -row))
    cut: BoolArray = (beside == ahead) & (beside < classes)
    cut &= (opposite == classes) & (behind == classes)
    cut[[0, -1]] = False
    cut[:, [0, -1]] = False
    return cut
