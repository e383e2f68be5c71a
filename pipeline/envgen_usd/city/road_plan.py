"""The road in plan, which stays free of objects."""

import numpy as np
import shapely

from envgen_usd.models.array_types import BoolArray, FloatArray

_LEAST_AREA = 1e-6


class RoadPlan:
    """The road surface in plan, with a spatial index.

    Bridges are a part of it, as trees would grow through them; tunnels are none.
    """

    def __init__(self, corners: FloatArray) -> None:
        """Takes triangles in plan, T x 3 x 2, metres."""
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        # Kerb faces are vertical and have no area in plan.
        flat = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) > _LEAST_AREA
        self._tree = shapely.STRtree(shapely.polygons(corners[flat]))

    def near(self, points: FloatArray, distance: float) -> BoolArray:
        """Returns a mask of the points (N x 2) on the road or within a distance of it, N."""
        hit = np.zeros(len(points), dtype=bool)
        hits = self._tree.query(
            shapely.points(points[:, :2]), predicate="dwithin", distance=distance
        )
        hit[hits[0]] = True
        return hit

    def touches(self, polygon: shapely.Polygon) -> bool:
        """Returns true if a polygon intersects the road."""
        return bool(len(self._tree.query(polygon, predicate="intersects")))
