"""Random points with a least distance between them."""

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.models.array_types import BoolArray, FloatArray


def spread(points: FloatArray, distance: float) -> BoolArray:
    """Returns a mask of the points that keep the distance from all kept earlier points, N.

    The result equals dart throwing in the order of the points (random sequential adsorption,
    Poisson-disc sampling). It takes a few rounds over all pairs: a point is kept if no earlier
    point in reach is undecided. All later points in its reach are then dropped.

    Args:
        points: N x 2, metres, in order of precedence.
        distance: Least distance between two kept points, metres.
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
