"""The frame of a plot's street side, and what has room in it."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.city.city_scene import Scene
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.landuse import Plot

_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@dataclass(frozen=True)
class PlotFrame:
    """Axes of a plot.

    Attributes:
        start: 2, start of the frontage, metres.
        along: 2, unit vector along the frontage.
        into: 2, unit vector from the frontage into the plot.
    """

    start: FloatArray
    along: FloatArray
    into: FloatArray

    @staticmethod
    def of(plot: Plot) -> "PlotFrame":
        """The frame of a plot."""
        start, end = plot.frontage
        along = (end - start) / np.hypot(*(end - start))
        return PlotFrame(start, along, np.array([-along[1], along[0]]))

    def inside(self, points: FloatArray) -> FloatArray:
        """Distances along and behind the frontage (N x 2) of points (N x 2), metres."""
        distances: FloatArray = (points - self.start) @ np.stack([self.along, self.into], axis=1)
        return distances

    def place(self, along: float, behind: float) -> FloatArray:
        """A point (2) by its distances along and behind the frontage, metres."""
        point: FloatArray = self.start + along * self.along + behind * self.into
        return point


def rectangle_at(
    place: FloatArray, axis: FloatArray, length: float, width: float
) -> shapely.Polygon:
    """A rectangle in plan.

    Args:
        place: 2, its middle, metres.
        axis: 2, unit vector along its length.
        length: Metres along the axis.
        width: Metres across it.
    """
    across = np.array([-axis[1], axis[0]])
    corners = _CORNERS * [length, width]
    return shapely.Polygon(place + corners @ np.stack([axis, across]))


def widened(shape: shapely.Polygon, distance: float) -> shapely.Polygon:
    """A rectangle with its sides moved outwards by a distance in metres."""
    return shape.buffer(distance, join_style="mitre")


def is_unoccupied(shape: shapely.Polygon, scene: Scene) -> bool:
    """True where neither roads nor what stands already touch a shape."""
    return not (scene.road.touches(shape) or scene.taken.touches(shape))
