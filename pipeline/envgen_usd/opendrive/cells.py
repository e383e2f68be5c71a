"""Which strip lies at a place, and how high: the strips' triangles in a spatial index."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.opendrive.strips import Strip

_NEAR = 3e-3
"""Distance in metres by which snapping may have moved a vertex off its strip."""


@dataclass(frozen=True)
class Hits:
    """Pairs of a place and a strip that lies there.

    Attributes:
        place: H, index of the place.
        strip: H, index of the strip.
        base: H, height of the strip there without lane height, metres.
        height: H, lane height there.
        depth: H, distance to the road's nearer outermost border.
    """

    place: IntArray
    strip: IntArray
    base: FloatArray
    height: FloatArray
    depth: FloatArray


class Cells:
    """Triangles of strips, to be asked what lies at a place."""

    def __init__(self, strips: Sequence[Strip]) -> None:
        """Cuts the strips into triangles; those without area are left out."""
        corners = [_strip_triangles(strip) for strip in strips]
        owner = np.repeat(np.arange(len(strips)), [len(part) for part in corners])
        triangles = np.concatenate(corners) if corners else np.empty((0, 3, 5))
        area = _cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        keep = np.abs(area) > 1e-7
        self._corners: FloatArray = triangles[keep]
        self._owner: IntArray = owner[keep]
        ring = self._corners[:, [0, 1, 2, 0], :2]
        self._tree = shapely.STRtree(shapely.polygons(ring))

    def covering(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """Pairs (place, strip) of all strips over each of the points (N x 2), sorted, unique."""
        place, triangle = self._tree.query(shapely.points(points), predicate="intersects")
        pairs = np.unique(np.column_stack([place, self._owner[triangle]]), axis=0)
        return pairs[:, 0], pairs[:, 1]

    def at(self, points: FloatArray) -> Hits:
        """Heights of all strips at or within millimetres of each of the points (N x 2)."""
        where = shapely.points(points)
        place, triangle = self._tree.query(where, predicate="dwithin", distance=_NEAR)
        lost = np.setdiff1d(np.arange(len(points)), place)
        if len(lost):
            again, nearest = self._tree.query_nearest(where[lost])
            place = np.concatenate([place, lost[again]])
            triangle = np.concatenate([triangle, nearest])
        return self._hits(points, place, triangle)

    def within(self, points: FloatArray, distance: float) -> Hits:
        """Heights of all strips at or within a distance (metres) of each of the points (N x 2)."""
        return self._hits(
            points,
            *self._tree.query(shapely.points(points), predicate="dwithin", distance=distance),
        )

    def _hits(self, points: FloatArray, place: IntArray, triangle: IntArray) -> Hits:
        corners = self._corners[triangle]
        weight = _weights(corners[..., :2], points[place])
        value = (corners[..., 2:] * weight[..., None]).sum(axis=1)
        return Hits(place, self._owner[triangle], value[:, 0], value[:, 1], value[:, 2])


def _strip_triangles(strip: Strip) -> FloatArray:
    """Triangles of a strip, T x 3 x (x, y, base, height, depth)."""
    left = np.column_stack([strip.left, strip.height[:, 0], strip.depth[:, 0]])
    right = np.column_stack([strip.right, strip.height[:, 1], strip.depth[:, 1]])
    return np.concatenate(
        [
            np.stack([right[:-1], right[1:], left[1:]], axis=1),
            np.stack([right[:-1], left[1:], left[:-1]], axis=1),
        ]
    )


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    product: FloatArray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def _weights(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Barycentric weights, N x 3, clamped to the triangle."""
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
