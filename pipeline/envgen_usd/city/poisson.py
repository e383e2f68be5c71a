"""Random places that keep a distance from one another."""

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.models.arrays import BoolArray, FloatArray


def spread(points: FloatArray, distance: float) -> BoolArray:
    """Returns which points remain when each that is too near to an earlier one is left out, N.

    The result is that of dart throwing in the order of the points (random sequential adsorption,
    Poisson-disc sampling), found in a few rounds over all pairs: a point stays if no earlier point
    in reach is still in question, and all later points in its reach go.

    Args:
        points: N x 2, metres, in the order in which they are thrown.
        distance: Least distance between two points that remain, metres.
    """
    kept = np.zeros(len(points), dtype=bool)
    open_points = np.ones(len(points), dtype=bool)
    if len(points) == 0 or distance <= 0.0:
        return open_points
    # query_pairs gives (i, j) with i < j: the earlier point first.
    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    while open_points.any():
        pairs = pairs[open_points[pairs].all(axis=1)]
        blocked = np.zeros(len(points), dtype=bool)
        blocked[pairs[:, 1]] = True
        chosen = open_points & ~blocked
        kept |= chosen
        open_points &= ~chosen
        open_points[pairs[chosen[pairs[:, 0]], 1]] = False
    return kept
