"""Heights of the nodes of a Lanelet2 map: what is missing or cannot be follows from its neighbours.

Editors leave nodes at a height of 0 or halfway to it. Such a node is far above or below the node
before or after it on the same bound, and far from the heights around it.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

_STEEPEST = 1.0
"""Largest slope along a bound; stairs have 0.6."""
_STEP = 1.0
"""Least rise between two nodes that counts, metres; kerbs and rounding are below it."""
_AROUND = 15
"""Number of nodes whose median is the height around a node."""


def repaired_heights(points: FloatArray, bounds: Sequence[IntArray]) -> tuple[FloatArray, int, int]:
    """Heights of all nodes, with those repaired that are missing or cannot be.

    A missing height is 0, as for the library Lanelet2, where the nodes around are near 0; writers
    leave it out there. A repaired node gets the height of the nearest sound node of a bound.

    Args:
        points: N x 3, metres; NaN for missing heights.
        bounds: Rows of the nodes of each bound, in order.

    Returns:
        N heights, metres; the numbers of nodes of bounds whose missing height is not 0, and of
        those with a wrong one.
    """
    known = np.isfinite(points[:, 2])
    height = np.nan_to_num(points[:, 2])
    on_bound = np.zeros(len(points), bool)
    for rows in bounds:
        on_bound[rows] = True
    suspect, rise = _steep(points, bounds)
    suspect |= ~known
    allowed = np.where(known, 0.5 * rise, _STEP)
    sound = ~suspect & (on_bound | ~(known & on_bound).any())
    if not (suspect.any() and sound.any()):
        return height, 0, 0
    rows = np.flatnonzero(suspect)
    count = min(_AROUND, int(sound.sum()))
    near = KDTree(points[sound, :2]).query(points[rows, :2], count)[1].reshape(len(rows), -1)
    around = np.median(height[sound][near], axis=1)
    wrong = np.zeros(len(points), bool)
    wrong[rows] = np.abs(height[rows] - around) > allowed[rows]
    sound |= suspect & ~wrong & on_bound
    repaired = height.copy()
    if wrong.any():
        nearest = KDTree(points[sound, :2]).query(points[wrong, :2])[1]
        repaired[wrong] = height[sound][nearest]
    return repaired, int((wrong & ~known & on_bound).sum()), int((wrong & known).sum())


def _steep(points: FloatArray, bounds: Sequence[IntArray]) -> tuple[BoolArray, FloatArray]:
    """Nodes before or after a step along a bound, and the smallest rise there in metres."""
    rise = np.full(len(points), np.inf)
    pairs = [np.column_stack([rows[:-1], rows[1:]]) for rows in bounds]
    first, second = np.concatenate([np.zeros((0, 2), np.int64), *pairs]).T
    step = points[second] - points[first]
    up, run = np.abs(step[:, 2]), np.hypot(step[:, 0], step[:, 1])
    counts = up > np.maximum(_STEP, _STEEPEST * run)
    for end in (first, second):
        np.minimum.at(rise, end[counts], up[counts])
    return np.isfinite(rise), rise
