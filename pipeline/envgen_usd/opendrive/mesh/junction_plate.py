"""A thin plate over a junction that fits the heights of its connecting roads."""

from collections.abc import Iterator, Sequence

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.opendrive.mesh.banded_solver import solve_banded
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
_ARM_WEIGHT, _BORDER_WEIGHT, _OTHER_WEIGHT, _RIDGE = 1e4, 0.1, 0.02, 1e-6
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
        mean = np.average(height, weights=weight)
        loads: FloatArray = weight * (height - mean)
        total, right = (
            np.bincount(node, each, minlength=used.size).reshape(self._shape)
            for each in (weight, loads)
        )
        self._heights = np.full(self._shape, np.nan)
        heights = self._heights
        # The band is as wide as the lines of nodes are long.
        if used.sum(axis=0).max() < used.sum(axis=1).max():
            heights, used, total, right = heights.T, used.T, total.T, right.T
        heights[used] = _solved(used, total[used] + _RIDGE, right[used]) + mean
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


def _solved(used: BoolArray, weight: FloatArray, right: FloatArray) -> FloatArray:
    """Returns the heights of the used nodes of a plate with weights and loads at these nodes."""
    count = len(right)
    number = np.full(used.shape, -1)
    number[used] = np.arange(count)
    diagonal = np.arange(count), np.arange(count), weight
    parts = zip(diagonal, *_stiffness(number), strict=True)
    rows, columns, values = (np.concatenate(part) for part in parts)
    return solve_banded(rows, columns, values, right)


def _stiffness(number: IntArray) -> Iterator[tuple[IntArray, IntArray, FloatArray]]:
    """Yields entries of the stiffness: second differences along both axes, and twice the mixed."""
    for before, middle, after in (
        (number[:-2], number[1:-1], number[2:]),
        (number[:, :-2], number[:, 1:-1], number[:, 2:]),
    ):
        yield _products([before, middle, after], np.array([1.0, -2.0, 1.0]))
    corners = [number[:-1, :-1], number[1:, 1:], number[1:, :-1], number[:-1, 1:]]
    yield _products(corners, np.sqrt(2.0) * np.array([1.0, 1.0, -1.0, -1.0]))


def _products(
    nodes: Sequence[IntArray], values: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Returns row, column and value of the squares of differences with all nodes present."""
    columns = np.stack([node.ravel() for node in nodes])
    columns = columns[:, (columns >= 0).all(axis=0)]
    shape = (len(values), *columns.shape)
    row, column = np.broadcast_to(columns[:, None], shape), np.broadcast_to(columns, shape)
    value = (_LENGTH / _SPACING) ** 4 * np.outer(values, values)
    return row.ravel(), column.ravel(), np.broadcast_to(value[..., None], shape).ravel()
