"""Shapes as cells of a chunk."""

from collections.abc import Iterable

import numpy as np
from rasterio.features import rasterize
from rasterio.transform import Affine
from shapely import Geometry

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.models.arrays import IntArray

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
