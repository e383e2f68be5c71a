"""Fields behind streets: cells of a Voronoi diagram of a disturbed lattice of the map."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.seeds import generator

_Values = TypeVar("_Values", FloatArray, IntArray)
FIELD = 85.0
"""Mean distance between the middles of fields, metres; a larger value gives larger fields."""
NUMBERS = 1 << 20
"""Numbers of fields are below this one."""
_SPREAD = 0.35
"""Largest move of a field's middle, as a share of `FIELD`; a larger value varies fields more."""
_BLOCK = 15
"""Cells along a side of a block whose fields are looked for at once; divides `LANDUSE_CELLS`."""
_AT_ONCE = 17
"""Blocks that are looked at together."""
_REACH = math.sqrt(2.0) * (_BLOCK // 2) * CELL_SIZE + 1e-6
"""Largest distance of a block's cell from its middle cell, metres, with room for rounding."""
_KEPT = 4096
"""Middles that a process keeps for the chunks around; each takes about 300 bytes."""


@dataclass(frozen=True)
class FieldCells:
    """The fields of a chunk's cells.

    Attributes:
        middles: F x 2, middles of the fields in and around the chunk, metres.
        numbers: F, a random number of each field, below `NUMBERS`.
        own: 255 x 255, index of each cell's field.
        margin: 255 x 255, distance from the field's border, metres.
        across: 255 x 255 x 2, unit vectors across the nearest part of the border.
    """

    middles: FloatArray
    numbers: IntArray
    own: IntArray
    margin: FloatArray
    across: FloatArray


def fields_of(chunk: Chunk, seed: int) -> FieldCells:
    """The fields of a chunk; they follow from their places, so that all chunks agree."""
    middles, numbers = _middles(chunk, seed)
    x, y = np.meshgrid(*chunk.cell_centres())
    away, nearest = _two_nearest(middles, _in_blocks(x), _in_blocks(y))
    step = middles[nearest[1]] - middles[nearest[0]]
    # Distance from the bisector of the two nearest middles.
    apart = np.sqrt(step[..., 0] ** 2 + step[..., 1] ** 2)
    margin = (away[1] ** 2 - away[0] ** 2) / (2.0 * apart)
    across = step / apart[..., None]
    own = _in_rows(nearest[0])
    return FieldCells(middles, numbers, own, _in_rows(margin), _in_rows(across))


def _two_nearest(middles: FloatArray, x: FloatArray, y: FloatArray) -> tuple[FloatArray, IntArray]:
    """The two middles nearest to each cell, of those that can be so for a cell of its block.

    Args:
        middles: F x 2, metres.
        x: B x C, places of the cells of each block, metres.
        y: B x C.

    Returns:
        Distances in ascending order, 2 x B x C, metres; indices of the middles, 2 x B x C.
    """
    centre = x.shape[1] // 2
    far = np.hypot(x[:, centre, None] - middles[:, 0], y[:, centre, None] - middles[:, 1])
    order = np.argsort(far, axis=1)
    reach = np.take_along_axis(far, order[:, 1:2], axis=1) + 2.0 * _REACH
    counts = (far <= reach).sum(axis=1)
    away, nearest = np.empty((2, *x.shape)), np.empty((2, *x.shape), np.int64)
    # A few blocks at a time stay in the processor's cache.
    for first in range(0, len(x), _AT_ONCE):
        some = np.s_[first : first + _AT_ONCE]
        candidates = order[some, : counts[some].max()]
        away[:, some], nearest[:, some] = _least_two(middles, candidates, x[some], y[some])
    return away, nearest


def _least_two(
    middles: FloatArray, candidates: IntArray, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, IntArray]:
    """As `_two_nearest`, of some candidates (B x K, K >= 2) for the cells of each block."""
    square, nearest = np.full((2, *x.shape), np.inf), np.zeros((2, *x.shape), np.int64)
    for index in candidates.T[..., None]:
        dx, dy = x - middles[index, 0], y - middles[index, 1]
        new = dx * dx + dy * dy
        nearer, near = new < square[0], new < square[1]
        nearest[1] = np.where(nearer, nearest[0], np.where(near, index, nearest[1]))
        nearest[0] = np.where(nearer, index, nearest[0])
        square[1] = np.minimum(np.maximum(new, square[0]), square[1])
        square[0] = np.minimum(new, square[0])
    return np.sqrt(square), nearest


def _in_blocks(values: FloatArray) -> FloatArray:
    """Values of a chunk's cells, 255 x 255, as blocks of cells, B x C."""
    count = LANDUSE_CELLS // _BLOCK
    blocks = values.reshape(count, _BLOCK, count, _BLOCK).swapaxes(1, 2)
    return blocks.reshape(count * count, _BLOCK * _BLOCK)


def _in_rows(values: _Values) -> _Values:
    """Values of blocks of cells, B x C x ..., as those of a chunk, 255 x 255 x ...."""
    count, more = LANDUSE_CELLS // _BLOCK, values.shape[2:]
    rows = values.reshape(count, count, _BLOCK, _BLOCK, *more).swapaxes(1, 2)
    return rows.reshape(LANDUSE_CELLS, LANDUSE_CELLS, *more)


def _middles(chunk: Chunk, seed: int) -> tuple[FloatArray, IntArray]:
    """Middles of the fields in and around a chunk, and their numbers."""
    low = np.floor(np.array(chunk.bounds[:2]) / FIELD).astype(int) - 2
    high = np.ceil(np.array(chunk.bounds[2:]) / FIELD).astype(int) + 2
    found = [
        _middle(column, row, seed)
        for column in range(low[0], high[0] + 1)
        for row in range(low[1], high[1] + 1)
    ]
    places = np.array([place for place, _ in found])
    return places * FIELD, np.array([number for _, number in found], np.int64)


@lru_cache(maxsize=_KEPT)
def _middle(column: int, row: int, seed: int) -> tuple[tuple[float, float], int]:
    """Middle of a field as a multiple of `FIELD`, and its number."""
    draw = generator(seed, "landuse", "field", column, row)
    x, y = np.array([column, row]) + 0.5 + draw.uniform(-_SPREAD, _SPREAD, 2)
    return (float(x), float(y)), int(draw.integers(NUMBERS))
