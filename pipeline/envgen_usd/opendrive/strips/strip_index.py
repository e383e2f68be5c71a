"""Spatial index of the strips' triangles: strips and heights at a position."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from envgen_usd.geometry.flat_arrays import ascending
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.opendrive.strips.lane_strips import Strip

_NEAR = 1e-2
"""Metres by which noding may move a vertex off its strip; a larger value finds more strips."""


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
        triangles, owner = _triangles(strips) if strips else (np.empty((0, 3, 5)), np.empty(0, int))
        area = _cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        keep = np.abs(area) > 1e-7
        self._corners: FloatArray = triangles[keep]
        self._owner: IntArray = owner[keep]
        flat = self._corners[..., :2]
        clockwise = area[keep] < 0
        self._flat: FloatArray = np.where(clockwise[:, None, None], flat[:, ::-1], flat)
        low, high = flat.min(axis=1), flat.max(axis=1)
        self._tree = shapely.STRtree(shapely.box(*low.T, *high.T))

    @cached_property
    def _triangle_tree(self) -> shapely.STRtree:
        return shapely.STRtree(shapely.polygons(self._corners[:, [0, 1, 2, 0], :2]))

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
            again, nearest = self._triangle_tree.query_nearest(shapely.points(points[lost]))
            place = np.concatenate([place, lost[again]])
            triangle = np.concatenate([triangle, nearest])
        return self._hits(points, place, triangle)

    def within(self, points: FloatArray, distance: float) -> Hits:
        """Returns the heights of all strips within a distance in metres of each point (N x 2)."""
        return self._hits(points, *self._near(points, distance))

    def _near(self, points: FloatArray, distance: float) -> tuple[IntArray, IntArray]:
        """Returns pairs (point, triangle) within a distance in metres, ascending by point."""
        low, high = points - distance, points + distance
        where = shapely.box(*low.T, *high.T) if distance else shapely.points(points)
        place, triangle = self._tree.query(where)
        beside, outside = np.zeros((2, len(place)), dtype=bool)
        for k in range(3):
            start, end = self._flat[triangle, k], self._flat[triangle, k - 2]
            edge, apart = end - start, points[place] - start
            side, square = _cross(edge, apart), (edge * edge).sum(axis=1)
            along = (edge * apart).sum(axis=1)
            beyond = side < 0
            outside |= beyond
            beside |= beyond & (along >= 0) & (along <= square)
            kept = side >= -distance * np.sqrt(square)
            place, triangle = place[kept], triangle[kept]
            beside, outside = beside[kept], outside[kept]
        # Beyond a sharp corner, points are within the distance of all lines, but far away.
        far = np.flatnonzero(outside & ~beside)
        far = far[_distance(self._flat[triangle[far]], points[place[far]]) > distance]
        return np.delete(place, far), np.delete(triangle, far)

    def _hits(self, points: FloatArray, place: IntArray, triangle: IntArray) -> Hits:
        corners = self._corners[triangle]
        weight = _weights(corners[..., :2], points[place])
        value = (corners[..., 2:] * weight[..., None]).sum(axis=1)
        return Hits(place, self._owner[triangle], value[:, 0], value[:, 1], value[:, 2])


def _triangles(strips: Sequence[Strip]) -> tuple[FloatArray, IntArray]:
    """Returns the triangles of strips, T x 3 x (x, y, base, height, depth), and their strips."""
    sides = [np.concatenate([strip.left for strip in strips])]
    sides.append(np.concatenate([strip.right for strip in strips]))
    above = np.concatenate([strip.height for strip in strips])
    depth = np.concatenate([strip.depth for strip in strips])
    left, right = (np.column_stack([sides[k], above[:, k], depth[:, k]]) for k in (0, 1))
    owner = np.repeat(np.arange(len(strips)), [len(strip.left) for strip in strips])
    row = np.flatnonzero(owner[1:] == owner[:-1])
    first = np.stack([right[row], right[row + 1], left[row + 1]], axis=1)
    second = np.stack([right[row], left[row + 1], left[row]], axis=1)
    return np.concatenate([first, second]), np.tile(owner[row], 2)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    product: FloatArray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def _distance(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Returns distances of points (N x 2) from the outlines of triangles (N x 3 x 2)."""
    edge = np.roll(corners, -1, axis=1) - corners
    apart = points[:, None] - corners
    share = (apart * edge).sum(axis=-1) / (edge * edge).sum(axis=-1)
    off = apart - np.clip(share, 0.0, 1.0)[..., None] * edge
    distance: FloatArray = np.sqrt((off * off).sum(axis=-1).min(axis=1))
    return distance


def _weights(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Returns barycentric weights, N x 3, clamped to the triangle."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = _cross(b - a, c - a)
    weight = np.column_stack(
        [_cross(b - points, c - points), _cross(c - points, a - points), np.zeros(len(points))]
    )
    weight /= area[:, None]
    weight[:, 2] = 1 - weight[:, 0] - weight[:, 1]
    weight = np.clip(weight, 0.0, 1.0)
    clamped: FloatArray = weight / weight.sum(axis=1, keepdims=True)
    return clamped
