"""Values on a regular lattice anchored at the origin of the road frame."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray, IntArray

STEPS = (1, 3, 5, 15, 51, 255)
"""Cells between the nodes of a lattice; each value divides the cells of a chunk."""
MAX_NODES = 3_000_000
"""Largest number of nodes; beyond it the next coarser step is used."""
FADING = 100.0
"""Metres beyond the lattice over which border values approach their mean by a factor of e."""


@dataclass(frozen=True)
class Extent:
    """Nodes of a lattice.

    Attributes:
        first: (column, row) of the first node, in units of `spacing`.
        spacing: Metres between nodes.
        shape: Number of rows and columns.
    """

    first: IntArray
    spacing: float
    shape: tuple[int, int]

    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Returns the coordinates of the nodes, metres: x of shape (W,), y of shape (H,)."""
        rows, columns = self.shape
        x = (self.first[0] + np.arange(columns)) * self.spacing
        return x, (self.first[1] + np.arange(rows)) * self.spacing


def extent_around(points: FloatArray, margin: float, within: Bounds | None = None) -> Extent:
    """Returns the finest lattice of bounded size around points (N x 2 or N x 3, metres).

    Args:
        points: At least one point.
        margin: Metres of lattice beyond the points.
        within: Rectangle that the lattice stays in, metres; `None` means everywhere.
    """
    low, high = points[:, :2].min(axis=0) - margin, points[:, :2].max(axis=0) + margin
    if within is not None:
        low, high = (np.clip(side, within[:2], within[2:]) for side in (low, high))
    for step in STEPS:
        first = np.floor(low / (step * CELL_SIZE)).astype(np.int64)
        columns, rows = np.ceil(high / (step * CELL_SIZE)).astype(np.int64) - first + 1
        if columns * rows <= MAX_NODES:
            break
    return Extent(first, step * CELL_SIZE, (int(rows), int(columns)))


@dataclass(frozen=True)
class Lattice:
    """Values at the nodes of a lattice, with interpolation.

    Attributes:
        extent: The nodes.
        values: H x W, metres.
    """

    extent: Extent
    values: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Interpolates bilinearly at points (N x 2 or N x 3, metres).

        Beyond the lattice, the values of its border fade to their mean.
        """
        first = self.extent.first
        last = first + np.array(self.values.shape)[::-1] - 1
        wanted = points[:, :2] / self.extent.spacing
        place = np.clip(wanted, first, last)
        node = np.minimum(np.floor(place).astype(np.int64), last - 1)
        # The shares follow from the place alone: lattices with equal nodes give equal numbers.
        u, v = (place - node).T
        column, row = (node - first).T
        south = self.values[row, column] * (1 - u) + self.values[row, column + 1] * u
        north = self.values[row + 1, column] * (1 - u) + self.values[row + 1, column + 1] * u
        result: FloatArray = south * (1 - v) + north * v
        if np.any(beyond := np.any(wanted != place, axis=1)):
            distance = np.hypot(*(wanted - place)[beyond].T) * self.extent.spacing
            mean = self._border_mean()
            result[beyond] = mean + (result[beyond] - mean) * np.exp(-distance / FADING)
        return result

    def _border_mean(self) -> float:
        sides = (self.values[0], self.values[-1], self.values[:, 0], self.values[:, -1])
        return float(np.concatenate(sides).mean())
