"""Rasterises shapes into the cells of a chunk."""

from collections.abc import Iterable

import numpy as np
from rasterio.features import rasterize
from rasterio.transform import Affine
from shapely import Geometry

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import IntArray


def cells_of_shapes(
    chunk: Chunk, shapes: Iterable[tuple[Geometry, int]], around: int = 0
) -> IntArray:
    """Numbers of the shapes at the centres of the cells; 0 without a shape.

    A later shape covers an earlier shape.

    Args:
        chunk: Tile.
        shapes: Shapes with their numbers.
        around: Width of the margin around the chunk, cells.

    Returns:
        Shape numbers, 255 x 255, enlarged by the margin on each side.
    """
    side = LANDUSE_CELLS + 2 * around
    corner = (chunk.x * LANDUSE_CELLS - around, chunk.y * LANDUSE_CELLS - around)
    return cells_of_box(corner, (side, side), shapes)


def cells_of_box(
    corner: tuple[int, int], shape: tuple[int, int], shapes: Iterable[tuple[Geometry, int]]
) -> IntArray:
    """As `cells_of_shapes`, for a box of the map's lattice of cells.

    Args:
        corner: Column and row of the first cell; cell (0, 0) begins at the origin.
        shape: Rows and columns of the box.
        shapes: Shapes with their numbers.
    """
    drawn = [pair for pair in shapes if not pair[0].is_empty]
    if not drawn:
        return np.zeros(shape, dtype=np.int64)
    x, y = corner[0] * CELL_SIZE, corner[1] * CELL_SIZE
    transform = Affine(CELL_SIZE, 0.0, x, 0.0, CELL_SIZE, y)
    cells: IntArray = rasterize(drawn, shape, 0, transform=transform, dtype="int32")
    return cells.astype(np.int64)
