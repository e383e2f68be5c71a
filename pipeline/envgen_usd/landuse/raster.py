"""Shapes and roads as cells of a chunk."""

from collections.abc import Iterable

import numpy as np
from rasterio.features import rasterize
from rasterio.transform import Affine
from shapely import Geometry

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import BoolArray, IntArray

SHAPE = (LANDUSE_CELLS, LANDUSE_CELLS)


def cells_of_shapes(chunk: Chunk, shapes: Iterable[tuple[Geometry, int]]) -> IntArray:
    """Numbers of the shapes that cover the centres of the cells, 255 x 255; 0 for none.

    A later shape covers an earlier one.
    """
    x, y = chunk.origin
    drawn = list(shapes)
    if not drawn:
        return np.zeros(SHAPE, dtype=np.int64)
    transform = Affine(CELL_SIZE, 0.0, x, 0.0, CELL_SIZE, y)
    cells: IntArray = rasterize(drawn, SHAPE, 0, transform=transform, dtype="int32")
    return cells.astype(np.int64)


def road_cells(chunk: Chunk, outline: Outline) -> BoolArray:
    """Cells whose centre is on the road, 255 x 255 (even-odd rule, row by row)."""
    x, y = chunk.cell_centres()
    right = outline.near((x[0], y[0], np.inf, y[-1]), 0.0)
    low, high = np.sort(np.stack([right.start[:, 1], right.end[:, 1]]), axis=0)
    first, last = np.searchsorted(y, low), np.searchsorted(y, high)
    edge = np.repeat(np.arange(len(first)), last - first)
    row = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - last, last - first)
    start, end = right.start[edge], right.end[edge]
    share = (y[row] - start[:, 1]) / (end[:, 1] - start[:, 1])
    crossing = start[:, 0] + share * (end[:, 0] - start[:, 0])
    # A crossing turns all cells to its left around.
    turns = np.zeros((LANDUSE_CELLS, LANDUSE_CELLS + 1), dtype=np.int64)
    np.add.at(turns, (row, np.searchsorted(x, crossing)), 1)
    to_the_right = np.cumsum(turns[:, ::-1], axis=1)[:, ::-1]
    on_road: BoolArray = to_the_right[:, 1:] % 2 == 1
    return on_road
