"""Polygons of a shell that meet other than at common vertices and edges (code 306)."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.geometry.collections import spans
from envgen_usd.geometry.iso19107.faults import SNAP
from envgen_usd.geometry.iso19107.places import places
from envgen_usd.geometry.planes import (
    flatten,
    next_in_ring,
    polygon_normals,
    polygon_of_point,
    ring_means,
)
from envgen_usd.geometry.shapes import flat_shapes
from envgen_usd.models.arrays import BoolArray, FloatArray, IntArray
from envgen_usd.models.polygons import Polygons

_PARALLEL = 1 - 1e-4


@dataclass(frozen=True)
class _Planes:
    """Planes of polygons: unit normals P x 3, and places P x 3 through which they run."""

    normals: FloatArray
    places: FloatArray


def crossing_pairs(polygons: Polygons, group: IntArray) -> IntArray:
    """Returns pairs of polygons of one group that cut, touch or cover each other, C x 2.

    Cuts and overlaps smaller than `SNAP` do not count, nor does meeting at a common vertex or
    along a common edge.

    Args:
        polygons: P polygons, flat and valid.
        group: P, for instance the shell of each.
    """
    planes = _Planes(
        polygon_normals(polygons),
        ring_means(polygons.points, polygons.ring_offsets)[polygons.polygon_offsets[:-1]],
    )
    pairs = _near_pairs(polygons, group)
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    flat_pairs, hits = _edges_through(polygons, planes, pairs)
    covered = flat_pairs[_overlap(polygons, planes, flat_pairs)]
    found = np.sort(np.concatenate([hits, covered]), axis=1)
    unique: IntArray = np.unique(found, axis=0)
    return unique


def _near_pairs(polygons: Polygons, group: IntArray) -> IntArray:
    """Pairs (i < j) of one group whose boxes meet."""
    starts = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    if not len(starts):
        return np.empty((0, 2), dtype=np.int64)
    low = np.minimum.reduceat(polygons.points, starts, axis=0)
    high = np.maximum.reduceat(polygons.points, starts, axis=0)
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    one, other = shapely.STRtree(boxes).query(boxes)
    keep = (one < other) & (group[one] == group[other])
    one, other = one[keep], other[keep]
    meet = (low[one, 2] <= high[other, 2]) & (low[other, 2] <= high[one, 2])
    return np.column_stack([one[meet], other[meet]])


def _edges_through(
    polygons: Polygons, planes: _Planes, pairs: IntArray
) -> tuple[IntArray, IntArray]:
    """Pairs whose first polygon lies in the other's plane, and those where it cuts the other."""
    first = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    last = polygons.ring_offsets[polygons.polygon_offsets[1:]]
    sizes = (last - first)[pairs[:, 0]]
    start = spans(first[pairs[:, 0]], sizes)
    pair = np.repeat(np.arange(len(pairs)), sizes)
    other = pairs[pair, 1]
    points, end = polygons.points, next_in_ring(polygons.ring_offsets)[start]
    normal, place = planes.normals[other], planes.places[other]
    d_start = np.einsum("ij,ij->i", points[start] - place, normal)
    d_end = np.einsum("ij,ij->i", points[end] - place, normal)
    away = np.zeros(len(pairs), dtype=bool)
    away[pair[np.abs(d_start) > 2 * SNAP]] = True
    parallel = np.abs(_dot(planes.normals[pairs[:, 0]], planes.normals[pairs[:, 1]])) > _PARALLEL
    shared_start, shared_end = _shared(polygons, other, start, end)
    cuts = (np.minimum(d_start, d_end) < -SNAP) & (np.maximum(d_start, d_end) > SNAP)
    cuts &= ~shared_start & ~shared_end
    touches = (np.abs(d_start) <= SNAP) & ~shared_start & ~cuts & away[pair]
    share = np.divide(d_start, d_start - d_end, out=np.zeros_like(d_start), where=cuts)
    where = points[start] + share[:, None] * (points[end] - points[start])
    chosen = np.flatnonzero(cuts | touches)
    inside = _strictly_inside(polygons, planes, where[chosen], other[chosen])
    return pairs[~away & parallel], pairs[np.unique(pair[chosen[inside]])]


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    dot: FloatArray = np.einsum("ij,ij->i", one, other)
    return dot


def _shared(polygons: Polygons, other: IntArray, *points: IntArray) -> list[BoolArray]:
    """Whether each point (M) is a vertex of the other polygon (M)."""
    vertex = places(polygons.points)
    count = len(polygons.points)
    known = polygon_of_point(polygons) * count + vertex
    return [np.isin(other * count + vertex[point], known) for point in points]


def _strictly_inside(
    polygons: Polygons, planes: _Planes, points: FloatArray, polygon: IntArray
) -> BoolArray:
    """Whether points (M x 3) in the planes of polygons (M) lie well within those."""
    names, place = np.unique(polygon, return_inverse=True)
    flat = flatten(polygons.points, planes.normals[polygon_of_point(polygons)])
    shapes = flat_shapes(polygons, flat, names)
    shapely.prepare(shapes)
    seen = flatten(points, planes.normals[polygon])
    inside: BoolArray = shapely.contains_xy(shapes[place], seen[:, 0], seen[:, 1])
    hits = np.flatnonzero(inside)
    rims = shapely.boundary(shapes)[place[hits]]
    inside[hits] = shapely.distance(rims, shapely.points(seen[hits])) > SNAP
    return inside


def _overlap(polygons: Polygons, planes: _Planes, pairs: IntArray) -> BoolArray:
    """Whether polygons that lie in one plane (C x 2) cover a part of each other."""
    overlap: BoolArray = np.zeros(len(pairs), dtype=bool)
    owner = polygon_of_point(polygons)
    # Both are to be seen along one axis; polygons of one axis are handled together.
    axis = np.abs(planes.normals).argmax(axis=1)[pairs[:, 1]]
    for direction in np.unique(axis).tolist():
        chosen = np.flatnonzero(axis == direction)
        names, place = np.unique(pairs[chosen], return_inverse=True)
        along = np.broadcast_to(np.eye(3)[direction], (len(owner), 3))
        shapes = flat_shapes(polygons, flatten(polygons.points, along), names)
        one, other = shapes[place.reshape(-1, 2)].T
        common = shapely.area(shapely.intersection(one, other))
        overlap[chosen] = common > SNAP * (shapely.length(one) + shapely.length(other)) / 2
    return overlap
