"""How many points are in boxes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray


def points_in_boxes(points: FloatArray, boxes: Sequence[Mapping[str, Any]]) -> IntArray:
    """Number of points in each box; points on a side are inside.

    Args:
        points: N x 3, metres.
        boxes: M boxes as `box_3d` of the output `boxes`: `centre`, `size` (length, width, height)
            in metres, and `yaw` of the length from the x axis in radians.

    Returns:
        M.
    """
    ordered = points[np.argsort(points[:, 0], kind="stable")]
    counts = np.zeros(len(boxes), np.int64)
    for number, box in enumerate(boxes):
        centre, half = np.array(box["centre"]), np.array(box["size"]) / 2.0
        reach = np.hypot(half[0], half[1])
        first = np.searchsorted(ordered[:, 0], centre[0] - reach, "left")
        last = np.searchsorted(ordered[:, 0], centre[0] + reach, "right")
        x, y, z = (ordered[first:last] - centre).T
        cos, sin = np.cos(box["yaw"]), np.sin(box["yaw"])
        inside = np.abs(cos * x + sin * y) <= half[0]
        inside &= np.abs(cos * y - sin * x) <= half[1]
        counts[number] = np.count_nonzero(inside & (np.abs(z) <= half[2]))
    return counts
