"""Fields behind streets: cells of a Voronoi diagram of a disturbed lattice of the map."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from envgen_usd.chunks import GRID, Chunk
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.seeds import generator

FIELD = 85.0
"""Mean distance between the middles of fields, metres; a larger value gives larger fields."""
NUMBERS = 1 << 20
"""Numbers of fields are below this one."""
_SPREAD = 0.35
"""Largest move of a field's middle, as a share of `FIELD`; a larger value varies fields more."""
_BLOCK = 15
"""Cells along a side of a block whose nearest fields are found together."""
_KEPT = 4096
"""Fields that a process keeps, as neighbouring chunks share most of theirs; 0.2 kB each."""


@dataclass(frozen=True)
class FieldCells:
    """The fields of a chunk's cells; what belongs to each cell is computed when it is asked for.

    Most chunks of a town have no field, and the search for the nearest middles takes longer than
    the rest of their landuse.

    Attributes:
        chunk: Tile.
        middles: F x 2, middles of the fields in and around the chunk, metres.
        numbers: F, a random number of each field, below `NUMBERS`.
    """

    chunk: Chunk
    middles: FloatArray
    numbers: IntArray

    @cached_property
    def own(self) -> IntArray:
        """255 x 255, index of each cell's field."""
        return self._nearest[0][0]

    @cached_property
    def margin(self) -> FloatArray:
        """255 x 255, distance from the field's border, metres."""
        _, (first, second) = self._nearest
        # Distance from the bisector of the two nearest middles.
        margin: FloatArray = (second**2 - first**2) / (2.0 * self._pairs[1][self._pair])
        return margin

    @cached_property
    def across(self) -> FloatArray:
        """255 x 255 x 2, unit vectors across the nearest part of the border."""
        return self._pairs[0][self._pair]

    @cached_property
    def _pair(self) -> IntArray:
        """255 x 255, row of `_pairs` for the two fields that are nearest to each cell."""
        own, other = self._nearest[0]
        return own * len(self.middles) + other

    @cached_property
    def _pairs(self) -> tuple[FloatArray, FloatArray]:
        """Unit vector from the middle of each field to that of each other, F² x 2, and distance."""
        step = (self.middles - self.middles[:, None]).reshape(-1, 2)
        apart = np.linalg.norm(step, axis=1)
        return step / np.where(apart > 0.0, apart, 1.0)[:, None], apart

    @cached_property
    def _nearest(self) -> tuple[tuple[IntArray, IntArray], tuple[FloatArray, FloatArray]]:
        """The two fields with the nearest middles, 255 x 255 each, and their distances, metres."""
        return _two_nearest(self.middles, *self.chunk.cell_centres())


def fields_of(chunk: Chunk, seed: int) -> FieldCells:
    """The fields of a chunk; they follow from their places, so that all chunks agree."""
    return FieldCells(chunk, *_middles(chunk, seed))


def _middles(chunk: Chunk, seed: int) -> tuple[FloatArray, IntArray]:
    """Middles of the fields in and around a chunk, and their numbers."""
    low = np.floor(np.array(chunk.bounds[:2]) / FIELD).astype(int) - 2
    high = np.ceil(np.array(chunk.bounds[2:]) / FIELD).astype(int) + 2
    places, numbers = [], []
    for column in range(low[0], high[0] + 1):
        for row in range(low[1], high[1] + 1):
            moved, number = _field(seed, column, row)
            places.append(np.array([column, row]) + 0.5 + moved)
            numbers.append(number)
    return np.array(places) * FIELD, np.array(numbers, np.int64)


@lru_cache(maxsize=_KEPT)
def _field(seed: int, column: int, row: int) -> tuple[FloatArray, int]:
    """Move of a field's middle, shares of `FIELD`, and its number."""
    draw = generator(seed, "landuse", "field", column, row)
    return draw.uniform(-_SPREAD, _SPREAD, 2), int(draw.integers(NUMBERS))


def _two_nearest(
    middles: FloatArray, x: FloatArray, y: FloatArray
) -> tuple[tuple[IntArray, IntArray], tuple[FloatArray, FloatArray]]:
    """The two middles nearest to each place of a grid, and their distances, metres.

    Few middles can be the nearest within a small block of places. So each block takes the places
    near its own middle one after the other, as long as they can be nearer than the second one.

    Args:
        middles: F x 2, metres.
        x: W, W a multiple of `_BLOCK`, ascending.
        y: H, likewise.

    Returns:
        Indices of the nearest and the second one, H x W each, and both distances.
    """
    columns, rows = x.reshape(-1, _BLOCK), y.reshape(-1, _BLOCK)
    order, counts = _candidates(middles, columns, rows)
    shape = (len(rows), len(columns), _BLOCK, _BLOCK)
    # Each value is H / B x W / B x B x B: rows and columns of blocks, then of places.
    away = [np.full(shape, np.inf), np.full(shape, np.inf)]
    index = [np.zeros(shape, np.int64), np.zeros(shape, np.int64)]
    for rank in range(int(counts.max())):
        row, column = np.nonzero(counts > rank)
        number = order[row, column, rank]
        dx = columns[column] - middles[number, :1]
        dy = rows[row] - middles[number, 1:]
        distance = np.sqrt((dx**2)[:, None, :] + (dy**2)[:, :, None])
        number = np.broadcast_to(number[:, None, None], distance.shape)
        for place in (0, 1):
            kept, kept_index = away[place][row, column], index[place][row, column]
            nearer = distance < kept
            away[place][row, column] = np.where(nearer, distance, kept)
            index[place][row, column] = np.where(nearer, number, kept_index)
            distance = np.where(nearer, kept, distance)
            number = np.where(nearer, kept_index, number)
    size = (len(y), len(x))
    first, second = (part.swapaxes(1, 2).reshape(size) for part in away)
    own, other = (part.swapaxes(1, 2).reshape(size) for part in index)
    return (own, other), (first, second)


def _candidates(
    middles: FloatArray, columns: FloatArray, rows: FloatArray
) -> tuple[IntArray, IntArray]:
    """Middles by their distance from that of a block, and how many can be among the two nearest.

    Args:
        middles: F x 2, metres.
        columns: W / B x B, x of the places of each block, metres.
        rows: H / B x B, y, likewise.

    Returns:
        H / B x W / B x F, and H / B x W / B.
    """
    dx = columns[:, _BLOCK // 2, None] - middles[:, 0]
    dy = rows[:, _BLOCK // 2, None] - middles[:, 1]
    away = np.hypot(dx[None], dy[:, None])
    order = np.argsort(away, axis=-1)
    second = np.take_along_axis(away, order[..., 1:2], axis=-1)
    reach = np.hypot(np.ptp(columns[0]), np.ptp(rows[0])) / 2.0
    counts: IntArray = np.sum(away <= second + 2.0 * reach + GRID, axis=-1)
    return order, counts
