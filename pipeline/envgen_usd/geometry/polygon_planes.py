"""Planes, areas and 2D coordinates of polygons."""

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons


def next_in_ring(ring_offsets: IntArray) -> IntArray:
    """Returns the index of the next point in the ring of each point, N.

    Args:
        ring_offsets: R + 1, as in `Polygons`.
    """
    following: IntArray = np.arange(1, ring_offsets[-1] + 1, dtype=np.int64)
    filled = ring_offsets[1:] > ring_offsets[:-1]
    following[ring_offsets[1:][filled] - 1] = ring_offsets[:-1][filled]
    return following


def ring_areas(points: FloatArray, ring_offsets: IntArray) -> FloatArray:
    """Returns the vector areas of rings by Newell's method, R x 3, square metres.

    The length is the area of a flat ring. The direction is its normal, seen against which the ring
    runs counter-clockwise.

    Args:
        points: N x 3, metres.
        ring_offsets: R + 1, as in `Polygons`.
    """
    areas: FloatArray = np.zeros((len(ring_offsets) - 1, 3))
    filled = ring_offsets[1:] > ring_offsets[:-1]
    starts = ring_offsets[:-1][filled]
    # Far from the origin, the products would lose significant digits.
    first = np.repeat(points[starts], np.diff(ring_offsets)[filled], axis=0)
    near = points - first
    cross = np.cross(near, near[next_in_ring(ring_offsets)])
    if len(starts):
        areas[filled] = 0.5 * np.add.reduceat(cross, starts, axis=0)
    return areas


def ring_means(points: FloatArray, ring_offsets: IntArray) -> FloatArray:
    """Returns the means of the rings' points, R x 3, metres; zero for an empty ring."""
    means: FloatArray = np.zeros((len(ring_offsets) - 1, 3))
    sizes = np.diff(ring_offsets)
    filled = sizes > 0
    if filled.any():
        sums = np.add.reduceat(points, ring_offsets[:-1][filled], axis=0)
        means[filled] = sums / sizes[filled, None]
    return means


def polygon_normals(polygons: Polygons) -> FloatArray:
    """Returns the unit normals of the exteriors, P x 3; zero for a polygon without area."""
    exteriors = ring_areas(polygons.points, polygons.ring_offsets)[polygons.polygon_offsets[:-1]]
    lengths = np.linalg.norm(exteriors, axis=1, keepdims=True)
    normals: FloatArray = np.divide(
        exteriors, lengths, out=np.zeros_like(exteriors), where=lengths > 0
    )
    return normals


def polygon_of_ring(polygons: Polygons) -> IntArray:
    """Returns the polygon of each ring, R."""
    return np.repeat(np.arange(len(polygons)), np.diff(polygons.polygon_offsets))


def polygon_of_point(polygons: Polygons) -> IntArray:
    """Returns the polygon of each point, N."""
    return np.repeat(polygon_of_ring(polygons), np.diff(polygons.ring_offsets))


def flat_coordinates(polygons: Polygons) -> FloatArray:
    """Projects the points to 2D, N x 2, metres, so that exteriors run counter-clockwise.

    See `flatten`; each polygon is seen against its normal.
    """
    return flatten(polygons.points, polygon_normals(polygons)[polygon_of_point(polygons)])


def flatten(points: FloatArray, normals: FloatArray) -> FloatArray:
    """Projects points to 2D, N x 2, metres, along the axis nearest to their normal.

    The projection keeps all digits. A flat polygon is simple in 2D if and only if it is simple in
    3D.

    Args:
        points: N x 3, metres.
        normals: N x 3; counter-clockwise rings around them stay counter-clockwise in 2D.
    """
    axis = np.abs(normals).argmax(axis=1)
    backwards = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0
    u, v = (axis + 1) % 3, (axis + 2) % 3
    columns = np.where(backwards[:, None], np.stack([v, u], axis=1), np.stack([u, v], axis=1))
    flat: FloatArray = np.take_along_axis(points, columns, axis=1)
    return flat
