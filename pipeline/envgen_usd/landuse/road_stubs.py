"""Paved ways that go on where roads end at nothing, so that no street ends in grass."""

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import RoadSurface

LENGTH = 40.0
"""Length of a way behind the end of a road, metres; a larger value paves more land."""
WIDTH = 5.0
"""Largest width of a way, metres; it is no wider than its road."""
_NARROWEST = 0.1
"""Width of a road below which no way goes on, metres."""
_BEYOND = 1.0
"""Distance behind the end of a road at which no other road may lie, metres."""
_ONTO = 0.8
"""Length of a way on its road, metres: a cell of landuse."""


def road_stubs(surface: RoadSurface) -> FloatArray:
    """Ways that lead straight on from the ends of roads without a successor, W x 4 x 2.

    Args:
        surface: The whole road.
    """
    ends = []
    for line in surface.roads:
        if line.junction or len(line.s) < 2 or line.is_motorway:
            continue
        left, right = line.left_border(), line.right_border()
        for place, sign in ((0, -1.0), (-1, 1.0)):
            heading = float(line.heading[place])
            out = sign * np.array([np.cos(heading), np.sin(heading)])
            across = left[place] - right[place]
            wide = float(np.hypot(*across))
            if wide < _NARROWEST:
                continue
            half = across / wide * min(wide, WIDTH) / 2.0
            ends.append(np.stack([(left[place] + right[place]) / 2.0, out, half]))
    if not ends:
        return np.empty((0, 4, 2))
    middle, out, half = np.moveaxis(np.array(ends), 1, 0)
    rings = np.array(
        [shapely.LinearRing(p[:, :2]) for p in surface.outline_loops() if len(p) > 2], object
    )
    point, ring = shapely.STRtree(shapely.polygons(rings)).query(
        shapely.points(middle + _BEYOND * out), "within"
    )
    # The road lies to the left of its outline: inside of more outer borders than of inner ones.
    turns = np.where(shapely.is_ccw(rings), 1, -1)
    ends_here = np.bincount(point, turns[ring], len(middle)) < 1
    middle, out, half = (part[ends_here] for part in (middle, out, half))
    near, far = middle - _ONTO * out, middle + LENGTH * out
    return np.stack([near - half, far - half, far + half, near + half], axis=1)
