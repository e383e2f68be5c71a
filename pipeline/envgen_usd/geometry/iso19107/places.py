"""Which points are one and the same."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from envgen_usd.geometry.collections import first_equal_row
from envgen_usd.geometry.iso19107.faults import SNAP
from envgen_usd.models.arrays import FloatArray, IntArray

# Neighbours on a grid of just this size are different places, whatever the rounding.
_NEAR = SNAP * (1 - 1e-3)


def places(points: FloatArray) -> IntArray:
    """Returns for each point (N x 3) the index of a point at the same place, N.

    Points that are nearer than `SNAP` are at one place, and get the same index.
    """
    first = first_equal_row(points)
    distinct = np.flatnonzero(first == np.arange(len(points)))
    if not len(distinct):
        return first
    near = KDTree(points[distinct]).query_pairs(_NEAR, output_type="ndarray")
    if not len(near):
        return first
    labels = linked(len(distinct), near[:, 0], near[:, 1])
    place = np.empty(len(points), dtype=np.int64)
    place[distinct] = distinct[first_equal_row(labels[:, None])]
    merged: IntArray = place[first]
    return merged


def linked(count: int, one: IntArray, other: IntArray) -> IntArray:
    """Returns labels (count) that are equal for what is linked, directly or through others.

    Args:
        count: Number of things.
        one: L, one end of each link.
        other: L, its other end.
    """
    graph = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(count, count))
    labels: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels
