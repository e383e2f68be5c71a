"""A thin plate over a junction that fits the heights of its connecting roads."""

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.sparse
from scipy.sparse.linalg import splu

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.strip_index import Cells

_SPACING = 1.0
"""Metres between grid nodes; a smaller value resolves finer shapes."""
_LENGTH = 3.0
"""Metres over which a height difference fades; a larger value gives a smoother surface."""
_ARM = 6
"""Grid steps of the arms that the fit includes; a larger value continues them further."""
_MARGIN = 2
"""Grid steps that the plate extends beyond the strips."""
_ARM_WEIGHT, _BORDER_WEIGHT, _OTHER_WEIGHT, _RIDGE = 100.0, 0.1, 0.02, 1e-6
"""Weights of arms, of lanes at their border and of other strips, and the ridge term."""


class Plate:
    """A grid over a junction and the first metres of its arms."""

    def __init__(self, strips: Sequence[Strip]) -> None:
        """Lays the grid over the strips of the junction."""
        sides = np.concatenate([side[:, :2] for s in strips for side in (s.left, s.right)])
        margin = _ARM + _MARGIN
        self._low = np.floor(sides.min(axis=0) / _SPACING) - margin
        self._shape = tuple(
            (np.ceil(sides.max(axis=0) / _SPACING) - self._low + margin + 1).astype(int).tolist()
        )

    def fit(
        self, cells: Cells, lanes: BoolArray, members: BoolArray, outside: BoolArray
    ) -> "Plate":
        """Fits the plate to the heights of the junction's strips and of the arms.

        Args:
            cells: Spatial index of S strips.
            lanes: S, whether a strip is a lane.
            members: S, whether it is in the junction.
            outside: S, whether it is a lane outside junctions.
        """
        node, height, weight = self._data(cells, lanes, members, outside)
        used = np.zeros(self._shape, dtype=bool)
        used.ravel()[node] = True
        used = _widened(used, _MARGIN)
        number = np.full(self._shape, -1)
        number[used] = np.arange(used.sum())
        node = number.ravel()[node]
        count = int(used.sum())
        total = np.bincount(node, weight, minlength=count) + _RIDGE
        mean = np.average(height, weights=weight)
        right = np.bincount(node, weight * (height - mean), minlength=count)
        bends = scipy.sparse.vstack(list(_bends(number, count)), format="csr")
        stiffness = (_LENGTH / _SPACING) ** 4 * bends.T @ bends
        matrix = (stiffness + scipy.sparse.diags(total)).tocsc()
        self._heights = np.full(self._shape, np.nan)
        # The matrix is symmetric and positive, so its own order of pivots is stable.
        factors = splu(matrix, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
        self._heights[used] = factors.solve(right) + mean
        return self

    def __call__(self, points: FloatArray) -> FloatArray:
        """Returns heights at points (N x 2), metres; NaN outside the grid."""
        at = points / _SPACING - self._low
        last = np.array(self._shape) - 2
        column, row = np.clip(np.floor(at), 0, last).astype(np.int64).T
        x, y = (at - np.column_stack([column, row])).T
        near, far = (
            self._heights[k, row] * (1 - y) + self._heights[k, row + 1] * y
            for k in (column, column + 1)
        )
        beside = ((at < 0) | (at > last + 1)).any(axis=1)
        heights: FloatArray = np.where(beside, np.nan, near * (1 - x) + far * x)
        return heights

    def _data(
        self, cells: Cells, lanes: BoolArray, members: BoolArray, outside: BoolArray
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Returns the nodes (H) on a strip, the strip's height there, and its weight."""
        grid = np.stack(np.meshgrid(*map(np.arange, self._shape), indexing="ij"), axis=-1)
        places = (grid.reshape(-1, 2) + self._low) * _SPACING
        inside = np.unique(cells.covering(places)[0])
        hits = cells.at(places[inside])
        node = inside[hits.place]
        reached = np.zeros(self._shape, dtype=bool)
        reached.ravel()[node[members[hits.strip]]] = True
        reached = _widened(reached, _ARM)
        weight = np.where(outside[hits.strip], _ARM_WEIGHT, np.maximum(hits.depth, 0.0))
        weight = np.where(lanes[hits.strip], weight + _BORDER_WEIGHT, _OTHER_WEIGHT)
        keep = (members | outside)[hits.strip] & reached.ravel()[node]
        return node[keep], hits.base[keep], weight[keep]


def _widened(chosen: BoolArray, steps: int) -> BoolArray:
    """Adds the nodes within steps of chosen nodes (rows x columns), also across corners."""
    wide = chosen.copy()
    for grid in (wide, wide.T):
        for _ in range(steps):
            grid[1:] |= grid[:-1].copy()
            grid[:-1] |= grid[1:].copy()
    return wide


def _bends(number: IntArray, count: int) -> Iterator[scipy.sparse.csr_matrix]:
    """Yields second differences of node heights: both axes, and twice the mixed difference."""
    for before, middle, after in (
        (number[:-2], number[1:-1], number[2:]),
        (number[:, :-2], number[:, 1:-1], number[:, 2:]),
    ):
        yield _rows([before, middle, after], [1.0, -2.0, 1.0], count)
    corners = [number[:-1, :-1], number[1:, 1:], number[1:, :-1], number[:-1, 1:]]
    yield np.sqrt(2.0) * _rows(corners, [1.0, 1.0, -1.0, -1.0], count)


def _rows(
    nodes: Sequence[IntArray], values: Sequence[float], count: int
) -> scipy.sparse.csr_matrix:
    """Returns a row for each position with all nodes present."""
    columns = np.stack([node.ravel() for node in nodes], axis=1)
    columns = columns[(columns >= 0).all(axis=1)]
    rows = np.repeat(np.arange(len(columns)), len(values))
    entries = np.tile(values, len(columns))
    return scipy.sparse.csr_matrix((entries, (rows, columns.ravel())), (len(columns), count))
