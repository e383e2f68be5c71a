"""The border of a set of cells as a ring of cell sides."""

from dataclasses import dataclass

import numpy as np
from rasterio.features import shapes

from envgen_usd.models.array_types import FloatArray, IntArray


@dataclass(frozen=True)
class CellRing:
    """Cell sides around a plot, counter-clockwise, in units of cells.

    Attributes:
        middles: S x 2, centre of each side.
        inner: S x 2, (column, row) of the plot's cell at the side.
        outer: S x 2, (column, row) of the adjacent cell outside.
    """

    middles: FloatArray
    inner: IntArray
    outer: IntArray

    def __len__(self) -> int:
        """Number of sides."""
        return len(self.middles)


def trace_ring(places: IntArray) -> CellRing:
    """Outer border of the largest connected component of a set of cells.

    Args:
        places: N x 2, (column, row), N > 0.
    """
    low = places.min(axis=0)
    width, height = places.max(axis=0) - low + 1
    mask = np.zeros((height, width), dtype=np.uint8)
    mask[places[:, 1] - low[1], places[:, 0] - low[0]] = 1
    parts = (np.array(shape["coordinates"][0]) for shape, _ in shapes(mask, mask == 1))
    corners = max(parts, key=lambda ring: abs(_area(ring)))
    if _area(corners) < 0:
        corners = corners[::-1]
    steps = np.diff(corners, axis=0)
    lengths = np.abs(steps).sum(axis=1).astype(np.int64)
    side = np.repeat(np.arange(len(lengths)), lengths)
    along = np.arange(len(side)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    direction = np.sign(steps)[side]
    middles = corners[:-1][side] + (along[:, None] + 0.5) * direction + low
    inwards = np.stack([-direction[:, 1], direction[:, 0]], axis=1) / 2
    inner, outer = (np.floor(middles + shift).astype(np.int64) for shift in (inwards, -inwards))
    return CellRing(middles, inner, outer)


def _area(ring: FloatArray) -> float:
    (x0, y0), (x1, y1) = ring[:-1].T, ring[1:].T
    return float(np.sum(x0 * y1 - x1 * y0) / 2)
