"""Transforms road coordinates (s, t, h) to x, y, z (ASAM OpenDRIVE 1.8.1, 7.4, chapter 10)."""

from typing import NamedTuple

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.geometry.lateral_profile import lateral_height


class Frames(NamedTuple):
    """N right-handed frames along a reference line.

    Attributes:
        origin: N x 3, metres, reference line with its elevation.
        forward: N x 3, unit, along s.
        left: N x 3, unit, along t, tilted by superelevation.
        up: N x 3, unit, along h.
    """

    origin: FloatArray
    forward: FloatArray
    left: FloatArray
    up: FloatArray


def road_frames(road: Road, s: FloatArray) -> Frames:
    """Returns the frames of a road at each s (N, metres)."""
    x, y, heading = evaluate(road.plan_view, s)
    return frames_of(
        np.column_stack([x, y, road.elevation(s)]),
        heading,
        np.arctan(road.elevation.derivative(s)),
        tilt(road, s),
    )


def tilt(road: Road, s: FloatArray) -> FloatArray:
    """Returns the superelevation at each s, radians; 0 with a crossSectionSurface (10.5.3)."""
    return np.zeros_like(s) if road.cross_section else road.superelevation(s)


def frames_of(
    origin: FloatArray, heading: FloatArray, pitch: FloatArray, roll: FloatArray
) -> Frames:
    """Returns frames from yaw, then pitch (positive climbs), then roll (left side up), radians."""
    cos_h, sin_h = np.cos(heading), np.sin(heading)
    cos_p, sin_p = np.cos(pitch), np.sin(pitch)
    forward = np.column_stack([cos_h * cos_p, sin_h * cos_p, sin_p])
    level_left = np.column_stack([-sin_h, cos_h, np.zeros_like(heading)])
    level_up = np.column_stack([-cos_h * sin_p, -sin_h * sin_p, cos_p])
    cos_r, sin_r = np.cos(roll)[:, None], np.sin(roll)[:, None]
    return Frames(
        origin,
        forward,
        level_left * cos_r + level_up * sin_r,
        level_up * cos_r - level_left * sin_r,
    )


def road_points(
    road: Road, s: FloatArray, t: FloatArray | float = 0.0, h: FloatArray | float = 0.0
) -> FloatArray:
    """Returns points in the road frame.

    Args:
        road: The road.
        s: N, metres along the reference line.
        t: N or a number, metres to the left.
        h: N or a number, metres above the road's surface without lane heights.

    Returns:
        N x 3, metres: the reference line, rotated by heading, slope and superelevation, plus the
        lateral profile.
    """
    s = np.asarray(s, dtype=np.float64)
    t = np.broadcast_to(np.asarray(t, dtype=np.float64), s.shape)
    frames = road_frames(road, s)
    height = lateral_height(road, s, t) + h
    return frames.origin + t[:, None] * frames.left + height[:, None] * frames.up
