"""Fields behind streets: cells of a Voronoi diagram of a disturbed lattice of the map."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.chunks import Chunk
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.seeds import generator

FIELD = 85.0
"""Mean distance between the middles of fields, metres; a larger value gives larger fields."""
NUMBERS = 1 << 20
"""Numbers of fields are below this one."""
_SPREAD = 0.35
"""Largest move of a field's middle, as a share of `FIELD`; a larger value varies fields more."""


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
    cells = np.stack([x.ravel(), y.ravel()], axis=1)
    away, nearest = (np.asarray(part) for part in cKDTree(middles).query(cells, k=2))
    step = middles[nearest[:, 1]] - middles[nearest[:, 0]]
    # Distance from the bisector of the two nearest middles.
    apart = np.linalg.norm(step, axis=1)
    margin: FloatArray = (away[:, 1] ** 2 - away[:, 0] ** 2) / (2.0 * apart)
    across = (step / apart[:, None]).reshape(*x.shape, 2)
    own = nearest[:, 0].reshape(x.shape).astype(np.int64)
    return FieldCells(middles, numbers, own, margin.reshape(x.shape), across)


def _middles(chunk: Chunk, seed: int) -> tuple[FloatArray, IntArray]:
    """Middles of the fields in and around a chunk, and their numbers."""
    low = np.floor(np.array(chunk.bounds[:2]) / FIELD).astype(int) - 2
    high = np.ceil(np.array(chunk.bounds[2:]) / FIELD).astype(int) + 2
    places, numbers = [], []
    for column in range(low[0], high[0] + 1):
        for row in range(low[1], high[1] + 1):
            draw = generator(seed, "landuse", "field", column, row)
            places.append(np.array([column, row]) + 0.5 + draw.uniform(-_SPREAD, _SPREAD, 2))
            numbers.append(int(draw.integers(NUMBERS)))
    return np.array(places) * FIELD, np.array(numbers, np.int64)
