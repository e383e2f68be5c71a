"""Spatial index of the strips' triangles: strips and heights at a position."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from envgen_usd.geometry.flat_arrays import ascending
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.opendrive.strips.lane_strips import Strip

_NEAR = 1e-2
"""Metres by which noding may move a vertex off its strip; a larger value finds more strips."""
_FAR = tuple(4.0**power for power in range(15))
"""Distances from a point within which its nearest triangle is looked for in turn, metres: the last
is larger than any map. A larger first one costs memory."""
_AT_A_TIME = 1 << 15
"""Points or pairs that are computed at a time; a larger value costs memory."""


@dataclass(frozen=True)
class Hits:
    """Pairs of a position and a strip at that position.

    Attributes:
        place: H, index of the position.
        strip: H, index of the strip.
        base: H, height of the strip without lane height, metres.
        height: H, lane height, metres.
        depth: H, distance from the road's nearer outermost border, metres.
    """

    place: IntArray
    strip: IntArray
    base: FloatArray
    height: FloatArray
    depth: FloatArray


class Cells:
    """Spatial index of the triangles of strips."""

    def __init__(self, strips: Sequence[Strip]) -> None:
        """Splits the strips into triangles; triangles without area are left out."""
        corners, owner = _triangles(strips) if strips else (np.empty((3, 5, 0)), np.empty(0, int))
        a, b, c = corners[:, :2]
        area = _cross(b - a, c - a)
        keep = np.abs(area) > 1e-7
        self._corners: FloatArray = corners[..., keep]
        self._owner: IntArray = owner[keep]
        flat = self._corners[:, :2]
        self._flat: FloatArray = np.where(area[keep] < 0, flat[::-1], flat)
        self._edge: FloatArray = np.roll(self._flat, -1, axis=0) - self._flat
        # Of shapes wider by the usual distance, points are asked for, which are made faster than
        # boxes. The tree knows boxes alone, and a diagonal takes a third of their memory.
        ends = np.stack([flat.min(axis=0) - _NEAR, flat.max(axis=0) + _NEAR])
        self._tree = shapely.STRtree(shapely.linestrings(np.moveaxis(ends, 2, 0)))

    def covering(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """Returns sorted, unique pairs (point, strip) of all strips over the points (N x 2)."""
        place, triangle = self._near(points, 0.0)
        count = int(self._owner.max(initial=0)) + 1
        return np.divmod(ascending(place * count + self._owner[triangle]), count)

    def at(self, points: FloatArray) -> Hits:
        """Returns the heights of all strips within `_NEAR` of each point (N x 2)."""
        place, triangle = self._near(points, _NEAR)
        missed = np.ones(len(points), dtype=bool)
        missed[place] = False
        lost = np.flatnonzero(missed)
        if len(lost):
            again, nearest = self._nearest(points[lost])
            place = np.concatenate([place, lost[again]])
            triangle = np.concatenate([triangle, nearest])
        return self._hits(points, place, triangle)

    def _nearest(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """Returns sorted pairs of each point (N x 2) and all triangles that are nearest to it."""
        pairs, left = [np.empty((2, 0), np.int64)], np.arange(len(points))
        # A point is rarely far from all triangles, and polygons of all of them need memory.
        for reach in _FAR:
            where, at = shapely.points(points[left]), np.ascontiguousarray(points[left].T)
            near = np.unique(self._tree.query(_boxes(at, at, reach))[1])
            found, nearest = self._polygons(near).query_nearest(where, max_distance=reach)
            pairs.append(np.stack([left[found], near[nearest]]))
            left = np.delete(left, found)
            if not len(left):
                break
        place, triangle = np.concatenate(pairs, axis=1)
        order = np.lexsort((triangle, place))
        return place[order], triangle[order]

    def _polygons(self, triangles: IntArray) -> shapely.STRtree:
        rings = np.moveaxis(self._corners[[0, 1, 2, 0], :2][..., triangles], 2, 0)
        return shapely.STRtree(shapely.polygons(rings))

    def within(self, points: FloatArray, distance: float) -> Hits:
        """Returns the heights of all strips within a distance in metres of each point (N x 2)."""
        return self._hits(points, *self._near(points, distance))

    def _near(self, points: FloatArray, distance: float) -> tuple[IntArray, IntArray]:
        """Returns pairs (point, triangle) within a distance in metres, ascending by point."""
        places, triangles = [], []
        for first in range(0, max(len(points), 1), _AT_A_TIME):
            place, triangle = self._near_few(points[first : first + _AT_A_TIME], distance)
            places.append(place + first)
            triangles.append(triangle)
        return np.concatenate(places), np.concatenate(triangles)

    def _near_few(self, points: FloatArray, distance: float) -> tuple[IntArray, IntArray]:
        at, reach = np.ascontiguousarray(points.T), distance - _NEAR
        where = _boxes(at, at, reach) if reach > 0 else shapely.points(points)
        place, triangle = self._tree.query(where)
        beside, outside = np.zeros((2, len(place)), dtype=bool)
        for corner, line in zip(self._flat, self._edge, strict=True):
            edge, apart = line.take(triangle, 1), at.take(place, 1) - corner.take(triangle, 1)
            side, square = _cross(edge, apart), _dot(edge, edge)
            beyond = np.flatnonzero(side < 0)
            along = _dot(edge[:, beyond], apart[:, beyond])
            outside[beyond] = True
            beside[beyond] |= (along >= 0) & (along <= square[beyond])
            kept = np.flatnonzero(side >= -distance * np.sqrt(square))
            place, triangle = place[kept], triangle[kept]
            beside, outside = beside[kept], outside[kept]
        # Beyond a sharp corner, points are within the distance of all lines, but far away.
        far = np.flatnonzero(outside & ~beside)
        there = self._flat[..., triangle[far]], self._edge[..., triangle[far]]
        far = far[_distance(*there, at[:, place[far]]) > distance]
        return np.delete(place, far), np.delete(triangle, far)

    def _hits(self, points: FloatArray, place: IntArray, triangle: IntArray) -> Hits:
        values = np.empty((3, len(place)))
        for first in range(0, len(place), _AT_A_TIME):
            few = np.s_[first : first + _AT_A_TIME]
            corners = self._corners.take(triangle[few], 2)
            weight = _weights(corners[:, :2], points.T.take(place[few], 1))
            values[:, few] = (corners[:, 2:] * weight[:, None]).sum(axis=0)
        return Hits(place, self._owner[triangle], *values)


def _boxes(low: FloatArray, high: FloatArray, margin: float) -> npt.NDArray[np.object_]:
    """Returns boxes from low to high corners (2 x N), wider by a margin in metres."""
    boxes: npt.NDArray[np.object_] = shapely.box(*(low - margin), *(high + margin))
    return boxes


def _triangles(strips: Sequence[Strip]) -> tuple[FloatArray, IntArray]:
    """Returns the triangles of strips, 3 x (x, y, base, height, depth) x T, and their strips."""
    sides = [np.concatenate([strip.left for strip in strips])]
    sides.append(np.concatenate([strip.right for strip in strips]))
    above = np.concatenate([strip.height for strip in strips])
    depth = np.concatenate([strip.depth for strip in strips])
    left, right = (np.vstack([sides[k].T, above[:, k], depth[:, k]]) for k in (0, 1))
    owner = np.repeat(np.arange(len(strips)), [len(strip.left) for strip in strips])
    row = np.flatnonzero(owner[1:] == owner[:-1])
    start, end = right[:, row], left[:, row + 1]
    first = np.stack([start, right[:, row + 1], end])
    second = np.stack([start, end, left[:, row]])
    return np.concatenate([first, second], axis=2), np.tile(owner[row], 2)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Returns the cross product of vectors (2 x N)."""
    product: FloatArray = a[0] * b[1] - a[1] * b[0]
    return product


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Returns the scalar product of vectors (2 x N)."""
    product: FloatArray = a[0] * b[0] + a[1] * b[1]
    return product


def _distance(corners: FloatArray, edges: FloatArray, points: FloatArray) -> FloatArray:
    """Returns distances of points (2 x N) from the outlines of triangles (3 x 2 x N)."""
    squares = []
    for corner, edge in zip(corners, edges, strict=True):
        apart = points - corner
        off = apart - np.clip(_dot(apart, edge) / _dot(edge, edge), 0.0, 1.0) * edge
        squares.append(_dot(off, off))
    distance: FloatArray = np.sqrt(np.min(squares, axis=0))
    return distance


def _weights(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Returns barycentric weights (3 x N) of points (2 x N), clamped to triangles (3 x 2 x N)."""
    a, b, c = corners
    area = _cross(b - a, c - a)
    first, second = _cross(b - points, c - points) / area, _cross(c - points, a - points) / area
    weight = np.clip([first, second, 1 - first - second], 0.0, 1.0)
    clamped: FloatArray = weight / weight.sum(axis=0)
    return clamped
