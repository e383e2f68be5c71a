"""Ground faces on the grid: cells in two halves, and which cells stay whole."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS
from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.terrain.cut_corners import CORNERS, cut_corners


@dataclass(frozen=True)
class Faces:
    """F faces with the same number K of corners.

    Attributes:
        corners: F x K, codes of the vertices (`grid_nodes.codes_of`), counter-clockwise.
        cells: F, landuse cell (row * 255 + column) of each face.
    """

    corners: IntArray
    cells: IntArray


def halved_cells(
    clear: BoolArray, codes: IntArray, classes: IntArray | None
) -> tuple[BoolArray, Faces]:
    """Cuts the cells at staircases between landuse classes.

    Args:
        clear: 255 x 255, whether cells become faces.
        codes: 256 x 256, codes of the grid's corners.
        classes: 255 x 255, numbers of landuse; `None` keeps all cells whole.

    Returns:
        255 x 255, True for the cells that stay whole; triangles, in pairs of the cut corner and the
        rest.
    """
    corner, taken = np.full(clear.shape, -1), np.zeros(clear.shape, dtype=np.int64)
    if classes is not None:
        corner, taken = cut_corners(classes)
    cut = np.nonzero(clear & (corner >= 0))
    # The rotation brings the corner to be cut to the first position.
    order = (corner[cut][:, None] + np.arange(len(CORNERS))) % len(CORNERS)
    turned = np.take_along_axis(_corners(codes, *cut), order, axis=1)
    halves = np.stack([turned[:, [3, 0, 1]], turned[:, [1, 2, 3]]], axis=1).reshape(-1, 3)
    cells = np.stack([taken[cut], cut[0] * LANDUSE_CELLS + cut[1]], axis=1).ravel()
    return clear & (corner < 0), Faces(halves, cells)


def _corners(codes: IntArray, row: IntArray, column: IntArray) -> IntArray:
    """Returns the codes of the corners of cells, C x 4, in the order of `CORNERS`."""
    places = [(row + (up > 0), column + (right > 0)) for up, right in CORNERS]
    return np.stack([codes[place] for place in places], axis=1)
