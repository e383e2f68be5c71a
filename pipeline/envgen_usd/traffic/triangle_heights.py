"""Heights of triangles over and under places."""

from functools import cached_property

import numpy as np
import shapely

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

_LEAST_AREA = 1e-6
"""Least double area in plan of a triangle that faces up, m²; kerb faces are vertical."""


class TriangleHeights:
    """Triangles that face up, by place."""

    def __init__(self, corners: FloatArray) -> None:
        """Args: triangles, T x 3 x 3, metres, road frame, counter-clockwise seen from above."""
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        self._corners = corners[area > _LEAST_AREA]

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(shapely.polygons(self._corners[:, :, :2]))

    def at(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Returns each pair of a point and a triangle over or under it.

        Args:
            points: N x 2 or more, metres; x and y count.

        Returns:
            Number of the point, and height of the triangle there, metres.
        """
        row, triangle = self._tree.query(shapely.points(points[:, :2]), predicate="intersects")
        origin, first, second = self._corners[triangle].swapaxes(0, 1)
        across, along, to = first - origin, second - origin, points[row, :2] - origin[:, :2]
        area = across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]
        u = (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / area
        v = (across[:, 0] * to[:, 1] - across[:, 1] * to[:, 0]) / area
        height: FloatArray = origin[:, 2] + u * across[:, 2] + v * along[:, 2]
        return row, height

    def touches(self, shapes: FloatArray) -> BoolArray:
        """Returns which rectangles (N x 4 x 2) touch a triangle in plan, N."""
        hit = np.zeros(len(shapes), dtype=bool)
        hit[self._tree.query(shapely.polygons(shapes), predicate="intersects")[0]] = True
        return hit


def least_cost(row: IntArray, height: FloatArray, cost: FloatArray, count: int) -> FloatArray:
    """Returns the height of least cost for each of so many points, N; NaN without any."""
    found = np.full(count, np.nan)
    order = np.argsort(-cost, kind="stable")
    found[row[order]] = height[order]
    return found
