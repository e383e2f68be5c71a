"""Poses beside a road: from s, t and a height to the road frame (10.4, 10.5, 13.1)."""

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.curve_evaluation import bend, evaluate
from envgen_usd.opendrive.geometry.road_frame import road_points

_TOLERANCE = 0.02
"""Largest chord error in metres; a larger value gives fewer positions."""
_MOST_STEPS = 5000
"""Largest number of steps of a line; bounds the cost of hostile curves."""


def points_beside(road: Road, s: FloatArray, t: FloatArray, height: FloatArray) -> FloatArray:
    """Returns points beside a road, N x 3, metres, road frame.

    Slope and superelevation tilt the cross-section; the height is vertical.

    Args:
        road: The road.
        s: N, metres, clipped to the road.
        t: N, metres to the left.
        height: N, metres above the road's surface at (s, t).
    """
    points = road_points(road, np.clip(s, 0.0, road.length), t)
    points[:, 2] += height
    return points


def heading_at(road: Road, s: FloatArray) -> FloatArray:
    """Returns the heading of the reference line, radians."""
    return evaluate(road.plan_view, np.clip(s, 0.0, road.length))[2]


def sample(road: Road, start: float, end: float, t: float) -> FloatArray:
    """Returns positions s from start to end with a chord error below 2 cm at t."""
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
