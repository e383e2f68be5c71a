"""Wheels on a surface: where they touch it, and the pose of a rigid vehicle on them."""

import numpy as np

from envgen_usd.models.array_types import FloatArray

FLOATING = 0.01
"""Largest distance of a wheel of a rigid vehicle from the surface, metres; a larger value keeps
more parked vehicles at edges, and names fewer moving ones."""


def wheel_points(places: FloatArray, headings: FloatArray, wheels: FloatArray) -> FloatArray:
    """Returns where wheels touch the ground in plan, N x K x 2, metres.

    Args:
        places: N x 2 or more, metres.
        headings: N, radians.
        wheels: K x 2 for all, or N x K x 2, metres ahead and to the left of the place.
    """
    cos, sin = np.cos(headings)[:, None], np.sin(headings)[:, None]
    ahead, left = wheels[..., 0], wheels[..., 1]
    turned = np.stack([cos * ahead - sin * left, sin * ahead + cos * left], axis=2)
    points: FloatArray = places[:, None, :2] + turned
    return points


def rest(heights: FloatArray, wheels: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lays rigid vehicles onto the heights of their wheels, by least squares.

    Args:
        heights: N x K, metres; NaN where a wheel is beside the map. A row without any height
            stays NaN.
        wheels: K x 2 for all, or N x K x 2, metres ahead and to the left of the vehicle's place.

    Returns:
        Height of the place (N), roll and pitch (N x 2, radians about +x and +y) and what each wheel
        misses (N x K, metres up to the surface).
    """
    known = ~np.isnan(heights)
    count = known.sum(axis=1)
    mean = np.where(known, heights, 0.0).sum(axis=1) / np.where(count, count, np.nan)
    filled = np.where(known, heights, mean[:, None])
    matrix = np.concatenate([np.ones((*wheels.shape[:-1], 1)), wheels], axis=-1)  # (N x) K x 3
    plane = np.matmul(np.linalg.pinv(matrix), filled[..., None])  # N x 3 x 1
    lifts = np.where(known, filled - np.matmul(matrix, plane)[..., 0], 0.0)
    height, ahead, left = plane[..., 0].T
    pitch = -np.arctan(ahead)
    # The roll is about the lowered or raised +x.
    roll = np.arctan(left * np.cos(pitch))
    return height, np.stack([roll, pitch], axis=1), lifts
