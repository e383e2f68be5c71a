"""Segments by square cells of the plane: pairs that may meet, and segments near a point."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.geometry.flat_arrays import ascending, spans
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

_SIZE = 1000
"""Side of a cell in grid units; a larger value gives fewer cells with more segments each."""
_SPAN = 1 << 31
"""Larger than any number of rows of cells."""
_TOGETHER = 1 << 22
"""Pairs of segments in a block; a larger value takes more memory."""
_FEW = 0.1
"""Share of fresh segments below which the others are searched for those beside them first."""


class SegmentCells:
    """Every cell lists the segments that come within a reach of it."""

    def __init__(self, low: FloatArray, high: FloatArray, reach: float, fresh: BoolArray) -> None:
        """Lists N segments between two ends (2 x N, grid units) in the cells of fresh ones (N)."""
        key, segment = _visits(low, high, reach)
        if not fresh.all():
            kept = place_among(ascending(key[fresh[segment]]), key) >= 0
            key, segment = key[kept], segment[kept]
        order = np.argsort(key)
        self._segment, key = segment[order], key[order]
        self._first = np.flatnonzero(np.diff(key, prepend=-_SPAN * _SPAN))
        self._keys = key[self._first]
        self._count = np.diff(np.append(self._first, len(key)))

    def pairs(self) -> Iterator[tuple[IntArray, IntArray]]:
        """Yields pairs of segments in a cell, in blocks; a pair of several cells repeats."""
        end = np.repeat(self._first + self._count, self._count)
        following = end - np.arange(len(end)) - 1
        block = np.cumsum(following) // _TOGETHER
        starts = np.flatnonzero(np.diff(block, prepend=-1))
        for first, last in zip(starts, np.append(starts[1:], len(end)), strict=True):
            ones = np.arange(first, last)
            other = spans(ones + 1, following[first:last])
            yield np.repeat(self._segment[first:last], following[first:last]), self._segment[other]

    def near(self, points: IntArray) -> tuple[IntArray, IntArray]:
        """Returns pairs of a point (2 x N, grid units) and a segment of its cell."""
        cell = place_among(self._keys, _key(*(points // _SIZE)))
        point = np.flatnonzero(cell >= 0)
        count = self._count[cell[point]]
        return np.repeat(point, count), self._segment[spans(self._first[cell[point]], count)]


def beside(low: FloatArray, high: FloatArray, reach: float, fresh: BoolArray) -> IntArray:
    """Returns the segments (2 x N, grid units) that may share a cell with a fresh one (N)."""
    if fresh.mean() > _FEW:
        return np.arange(len(fresh))
    size = 8 * _SIZE
    left, right = (np.floor(x / size).astype(np.int64) for x in _bounds(low[0], high[0], reach))
    below, above = (np.floor(y / size).astype(np.int64) for y in _bounds(low[1], high[1], reach))
    width, height = right - left + 1, above - below + 1
    chosen = np.flatnonzero(fresh)
    owner = np.repeat(chosen, width[chosen])
    column = spans(left[chosen], width[chosen])
    row = spans(below[owner], height[owner])
    keys = ascending(_key(np.repeat(column, height[owner]), row))
    near = (width > 2) | (height > 2)
    for x in (left, right):
        for y in (below, above):
            near |= place_among(keys, _key(x, y)) >= 0
    return np.flatnonzero(near)


def _bounds(low: FloatArray, high: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
    margin = reach + _SIZE
    return np.minimum(low, high) - margin, np.maximum(low, high) + margin


def _key(column: IntArray, row: IntArray) -> IntArray:
    return column * _SPAN + row


def place_among(keys: IntArray, asked: IntArray) -> IntArray:
    """Returns the place of each asked key among ascending keys; -1 where it is absent."""
    if not len(keys):
        return np.full(len(asked), -1)
    place = np.minimum(np.searchsorted(keys, asked), len(keys) - 1)
    places: IntArray = np.where(keys[place] == asked, place, -1)
    return places


def _visits(low: FloatArray, high: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Returns pairs of a cell's key and a segment within reach of it.

    Steep segments are turned, so that a segment passes at most two rows within a column.
    """
    steep = np.abs(high[1] - low[1]) > np.abs(high[0] - low[0])
    low, high = np.where(steep, low[::-1], low), np.where(steep, high[::-1], high)
    falling = low[0] > high[0]
    low, high = np.where(falling, high, low), np.where(falling, low, high)
    first, last = _cell(low[0] - reach), _cell(high[0] + reach)
    slope = (high[1] - low[1]) / np.maximum(high[0] - low[0], 1.0)
    segment = np.repeat(np.arange(len(slope)), last - first + 1)
    column = spans(first, last - first + 1)
    x, y, slope, end = low[0][segment], low[1][segment], slope[segment], high[0][segment]
    ends = [
        y + slope * (np.clip(border, x, end) - x)
        for border in (column * _SIZE - reach, (column + 1) * _SIZE + reach)
    ]
    below, above = _cell(np.minimum(*ends) - reach), _cell(np.maximum(*ends) + reach)
    row = spans(below, above - below + 1)
    column = np.repeat(column, above - below + 1)
    segment = np.repeat(segment, above - below + 1)
    key = np.where(steep[segment], _key(row, column), _key(column, row))
    return key, segment


def _cell(values: FloatArray) -> IntArray:
    return np.floor(values / _SIZE).astype(np.int64)
