"""Places beside a road: from s, t and a height to the road frame (10.4, 10.5, 13.1)."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.opendrive.plan_view import bend, evaluate
from envgen_usd.opendrive.road_frame import road_points

_TOLERANCE = 0.02
_MOST_STEPS = 5000


@dataclass(frozen=True)
class Stand:
    """Where an instance of an object stands.

    Attributes:
        position: 3, metres, road frame.
        heading: Radians, counter-clockwise from +x.
        pitch: Radians, positive lowers +x.
        roll: Radians about the turned x.
    """

    position: FloatArray
    heading: float
    pitch: float = 0.0
    roll: float = 0.0

    def matrix(self) -> FloatArray:
        """Rotation (3 x 3, for column vectors) by heading, pitch, roll about z, y', x''."""
        (ch, cp, cr) = np.cos([self.heading, self.pitch, self.roll])
        (sh, sp, sr) = np.sin([self.heading, self.pitch, self.roll])
        about_z = np.array([[ch, -sh, 0], [sh, ch, 0], [0, 0, 1]])
        about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        turned: FloatArray = about_z @ about_y @ about_x
        return turned

    def places(self, local: FloatArray) -> FloatArray:
        """Points (N x 3: u, v, z) of the object's own frame in the road frame."""
        points: FloatArray = self.position + local @ self.matrix().T
        return points


def points_beside(road: Road, s: FloatArray, t: FloatArray, height: FloatArray) -> FloatArray:
    """Points beside a road, N x 3, metres.

    The cross-section turns with slope and superelevation, the height is upright.

    Args:
        road: The road.
        s: N, clipped to the road.
        t: N.
        height: N, above the road's surface at (s, t).
    """
    points = road_points(road, np.clip(s, 0.0, road.length), t)
    points[:, 2] += height
    return points


def heading_at(road: Road, s: FloatArray) -> FloatArray:
    """Heading of the reference line, radians."""
    return evaluate(road.plan_view, np.clip(s, 0.0, road.length))[2]


def sample(road: Road, start: float, end: float, t: float) -> FloatArray:
    """Places s from start to end between which a line at t is straight within 2 cm."""
    start, end = float(np.clip(start, 0, road.length)), float(np.clip(end, 0, road.length))
    if end - start < 1e-6:
        return np.empty(0)
    coarse = np.linspace(start, end, 33)
    curvature = float(bend(road.plan_view, coarse).max())
    stretch = 1 + abs(t) * curvature
    rise = np.gradient(road.elevation.derivative(coarse), coarse)
    steepest = max(curvature * stretch, float(np.abs(rise).max()), 1e-6)
    step = min(np.sqrt(8 * _TOLERANCE / steepest), 20.0)
    count = min(int(np.ceil((end - start) / step)), _MOST_STEPS)
    places = np.linspace(start, end, count + 1)
    joins = road.plan_view.s[(road.plan_view.s > start) & (road.plan_view.s < end)]
    return np.unique(np.concatenate([places, joins]))
