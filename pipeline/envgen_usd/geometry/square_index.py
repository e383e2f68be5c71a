"""Boxes by the squares of a grid that they touch, so that a place finds what lies near it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.flat_arrays import spans
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

SIDE = 50.0
"""Side of a square, metres. Larger squares hold more boxes that a question has to look at; smaller
ones take more memory."""
_SLACK = 1e-3
"""Metres; a box that only touches a rectangle is not lost by rounding."""
_BASE = 1 << 31

Bounds = tuple[float, float, float, float]
"""(min x, min y, max x, max y), metres; any may be infinite."""


def holds(bounds: Bounds, points: FloatArray) -> BoolArray:
    """Tells which points (N x 2) lie in a rectangle, with its west and south borders.

    So a point on the border of adjacent rectangles lies in one of them.
    """
    x0, y0, x1, y1 = bounds
    x, y = points[:, 0], points[:, 1]
    inside: BoolArray = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
    return inside


@dataclass(frozen=True)
class SquareIndex:
    """Rows of a table by the squares that their boxes touch.

    The index is made once for a map. An answer takes time that grows with the boxes near the
    rectangle, and not with those of the map.

    Attributes:
        squares: S, codes of the squares that hold boxes, ascending.
        ends: S + 1, where the rows of each square begin and end.
        rows: R, indices of boxes, square by square.
    """

    squares: IntArray
    ends: IntArray
    rows: IntArray

    @staticmethod
    def of(low: FloatArray, high: FloatArray) -> "SquareIndex":
        """Returns the index of N boxes.

        Args:
            low: N x 2, least x and y, metres.
            high: N x 2, greatest x and y.
        """
        first = np.floor(low / SIDE).astype(np.int64)
        across, up = (np.floor(high / SIDE).astype(np.int64) - first + 1).T
        counts = across * up
        rows = np.repeat(np.arange(len(counts)), counts)
        place = spans(np.zeros_like(counts), counts)
        column, line = first[rows, 0] + place // up[rows], first[rows, 1] + place % up[rows]
        codes = column * _BASE + line
        order = np.argsort(codes, kind="stable")
        squares, starts = np.unique(codes[order], return_index=True)
        return SquareIndex(squares, np.append(starts, len(codes)), rows[order])

    def near(self, bounds: Bounds, margin: float) -> IntArray:
        """Returns the rows of boxes near a rectangle, ascending.

        All boxes that come within the margin are there; some that lie farther away are, too.

        Args:
            bounds: The rectangle.
            margin: Metres.
        """
        if not len(self.squares):
            return np.empty(0, dtype=np.int64)
        reach = margin + _SLACK
        (left, bottom), (right, top) = (
            np.clip(np.floor((np.array(corner) + by) / SIDE), -_BASE // 4, _BASE // 4).astype(int)
            for corner, by in ((bounds[:2], -reach), (bounds[2:], reach))
        )
        half = _BASE // 2
        least, most = (self.squares[[0, -1]] + half) // _BASE
        columns = np.arange(max(left, least), min(right, most) + 1) * _BASE
        first = self.ends[np.searchsorted(self.squares, columns + bottom)]
        last = self.ends[np.searchsorted(self.squares, columns + top, side="right")]
        return np.unique(self.rows[spans(first, np.maximum(last - first, 0))])


@dataclass(frozen=True)
class LineIndex:
    """Polylines by place.

    Attributes:
        index: Of boxes around pieces that are no longer than `SIDE`.
        lines: B, the polyline of each box.
    """

    index: SquareIndex
    lines: IntArray

    @staticmethod
    def of(lines: Sequence[FloatArray], reach: FloatArray) -> "LineIndex":
        """Returns the index of L polylines.

        Args:
            lines: Each N_i x 2 or N_i x 3, metres; only x and y count.
            reach: L, metres beside each that belong to it.
        """
        sizes = np.array([len(points) for points in lines], dtype=np.int64)
        start = np.concatenate([np.empty((0, 2)), *(points[:, :2] for points in lines)])
        line = np.repeat(np.arange(len(sizes)), sizes)
        # A last point is a piece of no length, so that a line of a single point is there, too.
        following = np.arange(1, len(start) + 1)
        ends = np.cumsum(sizes)[sizes > 0] - 1
        following[ends] = ends
        step = start[following] - start
        counts = np.maximum(np.ceil(np.hypot(step[:, 0], step[:, 1]) / SIDE), 1).astype(np.int64)
        piece = np.repeat(np.arange(len(start)), counts)
        share = (spans(np.zeros_like(counts), counts) / counts[piece])[:, None]
        piece_start = start[piece] + share * step[piece]
        piece_end = start[piece] + (share + 1 / counts[piece, None]) * step[piece]
        beside = reach[line[piece], None]
        index = SquareIndex.of(
            np.minimum(piece_start, piece_end) - beside, np.maximum(piece_start, piece_end) + beside
        )
        return LineIndex(index, line[piece])

    def near(self, bounds: Bounds, margin: float) -> IntArray:
        """Returns the polylines near a rectangle, ascending; see `SquareIndex.near`."""
        return np.unique(self.lines[self.index.near(bounds, margin)])


def are_near(points: FloatArray, bounds: Bounds, margin: float) -> BoolArray:
    """Returns which of N x 2 points lie within a margin of a rectangle along both axes, N."""
    low, high = np.array(bounds[:2]) - margin, np.array(bounds[2:]) + margin
    near: BoolArray = np.all((points >= low) & (points <= high), axis=1)
    return near
