"""Identifies coincident points."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from envgen_usd.geometry.flat_arrays import first_equal_row
from envgen_usd.geometry.iso19107.fault_codes import SNAP
from envgen_usd.models.array_types import FloatArray, IntArray

# Neighbours at exactly this distance on a grid are distinct, whatever the rounding.
_NEAR = SNAP * (1 - 1e-3)


def places(points: FloatArray) -> IntArray:
    """Returns for each point (N x 3, metres) the index of a coincident point, N.

    Points nearer than `SNAP` coincide and have the same index.
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


def linked(count: int, first: IntArray, second: IntArray) -> IntArray:
    """Returns labels (count) that are equal for directly or indirectly linked items.

    Args:
        count: Number of items.
        first: L, first end of each link.
        second: L, second end of each link.
    """
    graph = coo_array((np.ones(len(first), dtype=bool), (first, second)), shape=(count, count))
    labels: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels
