"""Planes, areas and flatness of many polygons at once."""

import numpy as np

from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.polygons import Polygons


def next_in_ring(ring_offsets: IntArray) -> IntArray:
    """Returns the index of the point that follows each point in its ring, N.

    Args:
        ring_offsets: R + 1, as in `Polygons`.
    """
    following: IntArray = np.arange(1, ring_offsets[-1] + 1, dtype=np.int64)
    filled = ring_offsets[1:] > ring_offsets[:-1]
    following[ring_offsets[1:][filled] - 1] = ring_offsets[:-1][filled]
    return following


def ring_areas(points: FloatArray, ring_offsets: IntArray) -> FloatArray:
    """Returns the vector areas of rings by Newell's method, R x 3, square metres.

    The length is the area of a flat ring; the direction is its normal, from where it runs
    counter-clockwise.

    Args:
        points: N x 3.
        ring_offsets: R + 1, as in `Polygons`.
    """
    areas: FloatArray = np.zeros((len(ring_offsets) - 1, 3))
    filled = ring_offsets[1:] > ring_offsets[:-1]
    starts = ring_offsets[:-1][filled]
    # Far from the origin the products would lose the digits that count.
    first = np.repeat(points[starts], np.diff(ring_offsets)[filled], axis=0)
    near = points - first
    cross = np.cross(near, near[next_in_ring(ring_offsets)])
    if len(starts):
        areas[filled] = 0.5 * np.add.reduceat(cross, starts, axis=0)
    return areas


def ring_means(points: FloatArray, ring_offsets: IntArray) -> FloatArray:
    """Returns the means of the rings' points, R x 3; zero for a ring without points."""
    means: FloatArray = np.zeros((len(ring_offsets) - 1, 3))
    sizes = np.diff(ring_offsets)
    filled = sizes > 0
    if filled.any():
        sums = np.add.reduceat(points, ring_offsets[:-1][filled], axis=0)
        means[filled] = sums / sizes[filled, None]
    return means


def polygon_normals(polygons: Polygons) -> FloatArray:
    """Returns the unit normals of the exteriors, P x 3; zero where a polygon has no area."""
    exteriors = ring_areas(polygons.points, polygons.ring_offsets)[polygons.polygon_offsets[:-1]]
    lengths = np.linalg.norm(exteriors, axis=1, keepdims=True)
    normals: FloatArray = np.divide(
        exteriors, lengths, out=np.zeros_like(exteriors), where=lengths > 0
    )
    return normals


def polygon_areas(polygons: Polygons) -> FloatArray:
    """Returns the areas of the polygons without their holes, P, square metres."""
    rings = ring_areas(polygons.points, polygons.ring_offsets)
    exteriors = rings[polygons.polygon_offsets[:-1]]
    holes = np.ones(len(rings), dtype=bool)
    holes[polygons.polygon_offsets[:-1]] = False
    areas: FloatArray = np.linalg.norm(exteriors, axis=1)
    owner = polygon_of_ring(polygons)[holes]
    np.subtract.at(areas, owner, np.linalg.norm(rings[holes], axis=1))
    return areas


def polygon_of_ring(polygons: Polygons) -> IntArray:
    """Returns the polygon that owns each ring, R."""
    return np.repeat(np.arange(len(polygons)), np.diff(polygons.polygon_offsets))


def polygon_of_point(polygons: Polygons) -> IntArray:
    """Returns the polygon that owns each point, N."""
    return np.repeat(polygon_of_ring(polygons), np.diff(polygons.ring_offsets))


def flat_coordinates(polygons: Polygons) -> FloatArray:
    """Returns the points in 2D, N x 2, so that exteriors run counter-clockwise.

    See `flatten`; each polygon is seen against its own normal.
    """
    return flatten(polygons.points, polygon_normals(polygons)[polygon_of_point(polygons)])


def flatten(points: FloatArray, normals: FloatArray) -> FloatArray:
    """Returns points in 2D, N x 2, each seen along the axis that its normal is nearest to.

    Coordinates are thereby kept to the last digit, and a flat polygon is simple in 2D just where
    it is in 3D.

    Args:
        points: N x 3.
        normals: N x 3; what runs counter-clockwise about them does so in 2D too.
    """
    axis = np.abs(normals).argmax(axis=1)
    backwards = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0
    u, v = (axis + 1) % 3, (axis + 2) % 3
    columns = np.where(backwards[:, None], np.stack([v, u], axis=1), np.stack([u, v], axis=1))
    flat: FloatArray = np.take_along_axis(points, columns, axis=1)
    return flat
