"""Shapes as cells of a chunk."""

from collections.abc import Iterable

import numpy as np
from rasterio.features import rasterize
from rasterio.transform import Affine
from shapely import Geometry

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.models.arrays import IntArray


def cells_of_shapes(
    chunk: Chunk, shapes: Iterable[tuple[Geometry, int]], around: int = 0
) -> IntArray:
    """Numbers of the shapes that cover the centres of the cells; 0 for none.

    A later shape covers an earlier one.

    Args:
        chunk: Tile.
        shapes: Each with its number.
        around: Cells on every side of the chunk that are drawn too.

    Returns:
        255 x 255, and twice as many more as lie around.
    """
    x, y = np.array(chunk.origin) - around * CELL_SIZE
    shape = (LANDUSE_CELLS + 2 * around, LANDUSE_CELLS + 2 * around)
    drawn = list(shapes)
    if not drawn:
        return np.zeros(shape, dtype=np.int64)
    transform = Affine(CELL_SIZE, 0.0, x, 0.0, CELL_SIZE, y)
    cells: IntArray = rasterize(drawn, shape, 0, transform=transform, dtype="int32")
    return cells.astype(np.int64)
