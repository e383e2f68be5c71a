"""Classifies the cells of a chunk as ground, road, or the strip between both."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import BoolArray, FloatArray

CLEARANCE = 0.25
"""Least distance in metres of a grid vertex from the outline; a smaller value creates slivers."""
_SAMPLES = 0.1
"""Metres between samples of the outline; a smaller value costs time."""
_REACH = CLEARANCE + _SAMPLES / 2


@dataclass(frozen=True)
class Cells:
    """Classification of the cells of a chunk.

    Attributes:
        clear: 255 x 255, cells with ground only, at least `CLEARANCE` from the outline.
        strip: 255 x 255, cells with both road and ground, or with ground near the outline.
    """

    clear: BoolArray
    strip: BoolArray


def classify_cells(chunk: Chunk, outline: Outline) -> Cells:
    """Classifies the cells of a chunk.

    Args:
        chunk: Chunk.
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
    """Returns the cells within `CLEARANCE` of the outline, by squares around dense samples.

    The side of a square is shorter than that of a cell, so its corners reach every cell it meets.
    """
    touched = np.zeros((LANDUSE_CELLS, LANDUSE_CELLS), dtype=np.bool_)
    samples, _ = outline.samples(_SAMPLES)
    plan: FloatArray = samples[:, :2] - np.array(chunk.origin)
    for corner in np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)]) * _REACH:
        column, row = np.floor((plan + corner) / CELL_SIZE).astype(np.int64).T
        within = (column >= 0) & (column < LANDUSE_CELLS) & (row >= 0) & (row < LANDUSE_CELLS)
        touched[row[within], column[within]] = True
    return touched
