"""What nothing may stand on or in: the road in plan."""

import numpy as np
import shapely

from envgen_usd.models.arrays import BoolArray, FloatArray
from envgen_usd.models.surface import RoadSurface

_LEAST_AREA = 1e-6


class RoadPlan:
    """The road surface in plan, with an index for fast questions.

    Tunnels (negative levels) are left out; bridges count, as trees would grow through them.
    """

    def __init__(
        self, surface: RoadSurface, bounds: tuple[float, float, float, float], margin: float
    ) -> None:
        """Gathers the triangles near a box.

        Args:
            surface: The road.
            bounds: (min x, min y, max x, max y).
            margin: Metres around the bounds.
        """
        corners = surface.vertices[:, :2][surface.triangles]
        low, high = corners.min(axis=1), corners.max(axis=1)
        near = (high >= np.array(bounds[:2]) - margin).all(axis=1)
        near &= (low <= np.array(bounds[2:]) + margin).all(axis=1)
        near &= surface.triangle_level >= 0
        corners = corners[near]
        one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        # Kerbs stand upright and have no area in plan.
        flat = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) > _LEAST_AREA
        self._tree = shapely.STRtree(shapely.polygons(corners[flat]))

    def near(self, points: FloatArray, distance: float) -> BoolArray:
        """Returns which of N x 2 points lie on the road or within a distance of it, N."""
        found = np.zeros(len(points), dtype=bool)
        hits = self._tree.query(
            shapely.points(points[:, :2]), predicate="dwithin", distance=distance
        )
        found[hits[0]] = True
        return found

    def touches(self, polygon: shapely.Polygon) -> bool:
        """Returns whether a polygon has a place in common with the road."""
        return bool(len(self._tree.query(polygon, predicate="intersects")))
