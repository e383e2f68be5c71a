"""Ends of roads at nothing, and paved ways that go on there, so that no street ends in grass."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import RoadSurface

LENGTH = 40.0
"""Length of a way behind the end of a road, metres; a larger value paves more land."""
WIDTH = 5.0
"""Largest width of a way that leads to no street, metres; it is no wider than its road."""
ONTO = 0.8
"""Length of a way on its road, metres: a cell of landuse."""
_NARROWEST = 0.1
"""Width of a road below which no way goes on, metres."""
_BEYOND = 1.0
"""Distance behind the end of a road at which no other road may lie, metres."""


@dataclass(frozen=True)
class RoadEnd:
    """The end of a road that has no successor.

    Attributes:
        road: OpenDRIVE road id.
        middle: 2, metres: the middle between the borders of the road.
        out: 2, unit vector: the direction in which the road would go on.
        width: Distance of the borders, metres.
    """

    road: str
    middle: FloatArray
    out: FloatArray
    width: float

    def box(self, near: float, far: float, right: float, left: float) -> FloatArray:
        """Corners of a rectangle behind the end, 4 x 2, counter-clockwise from its near right.

        Args:
            near: Distance of its near side from the end, metres.
            far: Distance of its far side, metres.
            right: Offset of its right side to the left of the road's middle, metres.
            left: Offset of its left side, metres.
        """
        corners = np.array([(near, right), (far, right), (far, left), (near, left)])
        aside = np.array([-self.out[1], self.out[0]])
        placed: FloatArray = self.middle + corners @ np.stack([self.out, aside])
        return placed


def road_ends(surface: RoadSurface) -> list[RoadEnd]:
    """Ends of roads behind which no other road lies, in the order of the file.

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
            width = float(np.hypot(*(left[place] - right[place])))
            if width >= _NARROWEST:
                ends.append(RoadEnd(line.road, (left[place] + right[place]) / 2.0, out, width))
    if not ends:
        return []
    rings = np.array(
        [shapely.LinearRing(p[:, :2]) for p in surface.outline_loops() if len(p) > 2], object
    )
    behind = shapely.points([end.middle + _BEYOND * end.out for end in ends])
    point, ring = shapely.STRtree(shapely.polygons(rings)).query(behind, "within")
    # The road lies to the left of its outline: inside of more outer borders than of inner ones.
    turns = np.where(shapely.is_ccw(rings), 1, -1)
    free = np.bincount(point, turns[ring], len(ends)) < 1
    return [end for end, is_free in zip(ends, free, strict=True) if is_free]


def way_on(end: RoadEnd) -> FloatArray:
    """A paved way that leads straight on from the end of a road, 4 x 2."""
    half = min(end.width, WIDTH) / 2.0
    return end.box(-ONTO, LENGTH, -half, half)
