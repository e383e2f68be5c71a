"""Smooths heights in junctions where connecting roads disagree."""

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.sparse
from scipy.ndimage import binary_dilation, map_coordinates
from scipy.sparse.linalg import spsolve

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.strip_index import Cells, Hits

_SPACING = 1.0
"""Metres between grid nodes; a smaller value resolves finer shapes."""
_LENGTH = 3.0
"""Metres over which a height difference fades; a larger value gives a smoother surface."""
_AGREED = 5e-3
"""Height difference in metres below which connecting roads agree and stay unchanged."""
_ARM = 6
"""Grid steps of the arms that the fit includes; a larger value continues them further."""
_MARGIN = 2
"""Grid steps that the plate extends beyond the strips."""
_AT_ARM = 0.1
"""Metres from an arm within which the arm alone determines the height."""
_AROUND = np.ones((3, 3), dtype=bool)
_ARM_WEIGHT, _BORDER_WEIGHT, _OTHER_WEIGHT, _RIDGE = 100.0, 0.1, 0.02, 1e-6
"""Weights of arms, of lanes at their border and of other strips, and the ridge term."""


def smooth_junctions(
    base: FloatArray, points: FloatArray, hits: Hits, strips: Sequence[Strip], cells: Cells
) -> dict[str, float]:
    """Replaces heights in junctions with disagreeing connecting roads, in place.

    The new surface is a thin plate on a grid. It fits all connecting roads and continues into the
    arms, which keep their heights.

    Args:
        base: P, metres, heights without lane heights; changed in place.
        points: P x 2, metres.
        hits: Strips at the points.
        strips: Strips of lanes.
        cells: Spatial index of the strips.

    Returns:
        The largest disagreement in metres by junction id.
    """
    names = [strip.patch.junction for strip in strips]
    disagreeing = _disagreeing(hits, strips, len(points))
    for name in sorted(disagreeing):
        members = np.array([one == name for one in names])
        outside = np.array([not s.patch.junction and s.patch.kind == "lane" for s in strips])
        place = np.setdiff1d(hits.place[members[hits.strip]], hits.place[outside[hits.strip]])
        plate = _Plate([strip for strip, chosen in zip(strips, members, strict=True) if chosen])
        height = plate.fit(cells, strips, members, outside)(points[place])
        near = cells.within(points[place], _AT_ARM)
        at_arm = np.flatnonzero(outside[near.strip])
        height[near.place[at_arm]] = near.base[at_arm]
        known = np.isfinite(height)
        base[place[known]] = height[known]
    return disagreeing


def _disagreeing(hits: Hits, strips: Sequence[Strip], count: int) -> dict[str, float]:
    """Returns the largest height differences of connecting roads by junction, metres."""
    lanes = np.array([bool(s.patch.junction) and s.patch.kind == "lane" for s in strips])
    chosen = np.flatnonzero(lanes[hits.strip])
    place, height = hits.place[chosen], hits.base[chosen]
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, place, height)
    np.maximum.at(high, place, height)
    apart = np.zeros(len(strips))
    np.maximum.at(apart, hits.strip[chosen], (high - low)[place])
    largest: dict[str, float] = {}
    for number in np.flatnonzero(apart > _AGREED).tolist():
        name = strips[number].patch.junction
        largest[name] = max(largest.get(name, 0.0), float(apart[number]))
    return largest


class _Plate:
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
        self, cells: Cells, strips: Sequence[Strip], members: BoolArray, outside: BoolArray
    ) -> "_Plate":
        """Fits the plate to the heights of the junction's strips and of the arms."""
        node, height, weight = self._data(cells, strips, members, outside)
        used = np.zeros(self._shape, dtype=bool)
        used.ravel()[node] = True
        used = binary_dilation(used, _AROUND, _MARGIN)
        number = np.full(self._shape, -1)
        number[used] = np.arange(used.sum())
        node = number.ravel()[node]
        count = int(used.sum())
        total = np.bincount(node, weight, minlength=count) + _RIDGE
        mean = np.average(height, weights=weight)
        right = np.bincount(node, weight * (height - mean), minlength=count)
        matrix = scipy.sparse.diags(total)
        for bend in _bends(number, count):
            matrix = matrix + (_LENGTH / _SPACING) ** 4 * bend.T @ bend
        self._heights = np.full(self._shape, np.nan)
        self._heights[used] = spsolve(matrix.tocsc(), right) + mean
        return self

    def __call__(self, points: FloatArray) -> FloatArray:
        """Returns heights at points (N x 2), metres; NaN outside the grid."""
        at = points.T / _SPACING - self._low[:, None]
        heights: FloatArray = map_coordinates(self._heights, at, order=1, cval=np.nan)
        return heights

    def _data(
        self, cells: Cells, strips: Sequence[Strip], members: BoolArray, outside: BoolArray
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Returns the nodes (H) on a strip, the strip's height there, and its weight."""
        grid = np.stack(np.meshgrid(*map(np.arange, self._shape), indexing="ij"), axis=-1)
        places = (grid.reshape(-1, 2) + self._low) * _SPACING
        inside = np.unique(cells.covering(places)[0])
        hits = cells.at(places[inside])
        node = inside[hits.place]
        reached = np.zeros(self._shape, dtype=bool)
        reached.ravel()[node[members[hits.strip]]] = True
        reached = binary_dilation(reached, _AROUND, _ARM)
        weight = np.where(outside[hits.strip], _ARM_WEIGHT, np.maximum(hits.depth, 0.0))
        kinds = np.array([strip.patch.kind == "lane" for strip in strips])
        weight = np.where(kinds[hits.strip], weight + _BORDER_WEIGHT, _OTHER_WEIGHT)
        keep = (members | outside)[hits.strip] & reached.ravel()[node]
        return node[keep], hits.base[keep], weight[keep]


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
