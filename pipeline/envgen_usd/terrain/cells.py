"""Which cells of a chunk are ground, road, or the strip where both meet."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import BoolArray, FloatArray

CLEARANCE = 0.25
"""Least distance in metres between the outline and a grid corner that is a vertex of the ground;
nearer ones would make slivers."""
_SAMPLES = 0.1
_REACH = CLEARANCE + _SAMPLES / 2


@dataclass(frozen=True)
class Cells:
    """Cells of one chunk by what lies on them.

    Attributes:
        clear: 255 x 255, ground only, and no outline nearer than `CLEARANCE`.
        strip: 255 x 255, both road and ground, or ground near the outline.
    """

    clear: BoolArray
    strip: BoolArray


def classify_cells(chunk: Chunk, outline: Outline) -> Cells:
    """Tells the cells of a chunk apart.

    Args:
        chunk: Tile.
        outline: The whole outline, not only the edges near the chunk.
    """
    strip = _touched(chunk, outline.near(chunk.bounds, 1.0))
    regions, count = ndimage.label(~strip)
    first = np.array(ndimage.maximum_position(~strip, regions, np.arange(1, count + 1)))
    x, y = chunk.cell_centres()
    inside = outline.encloses(np.stack([x[first[:, 1]], y[first[:, 0]]], axis=1))
    clear = np.concatenate([[False], ~inside])[regions]
    return Cells(clear, strip)


def _touched(chunk: Chunk, outline: Outline) -> BoolArray:
    """Cells within `CLEARANCE` of the outline, by squares around dense samples of it.

    A square's side is shorter than a cell's, so its corners find every cell that it meets.
    """
    touched = np.zeros((LANDUSE_CELLS, LANDUSE_CELLS), dtype=np.bool_)
    samples, _ = outline.samples(_SAMPLES)
    plan: FloatArray = samples[:, :2] - np.array(chunk.origin)
    for corner in np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)]) * _REACH:
        column, row = np.floor((plan + corner) / CELL_SIZE).astype(np.int64).T
        within = (column >= 0) & (column < LANDUSE_CELLS) & (row >= 0) & (row < LANDUSE_CELLS)
        touched[row[within], column[within]] = True
    return touched
