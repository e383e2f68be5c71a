"""Cells of a road, and those beside it."""

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import BoolArray

VERGE_CELLS = 2
"""Width of the verge beside a road, cells. Water begins behind it, so that no road is its shore."""


def road_cells(chunk: Chunk, outline: Outline, around: int = 0) -> tuple[BoolArray, BoolArray]:
    """Returns the cells of a chunk on the road, and those on it or its verge.

    Args:
        chunk: The chunk.
        outline: Outline of the roads.
        around: Cells around the chunk that are wanted, too.

    Returns:
        Two arrays of S x S with S = 255 + 2 `around`.
    """
    beyond = np.arange(1, around + VERGE_CELLS + 1) * CELL_SIZE
    x, y = (
        np.concatenate([axis[0] - beyond[::-1], axis, axis[-1] + beyond])
        for axis in chunk.cell_centres()
    )
    wide = outline.encloses_grid(x, y)
    own = np.s_[VERGE_CELLS:-VERGE_CELLS, VERGE_CELLS:-VERGE_CELLS]
    near: BoolArray = ndimage.binary_dilation(wide, iterations=VERGE_CELLS)[own]
    return wide[own], near
