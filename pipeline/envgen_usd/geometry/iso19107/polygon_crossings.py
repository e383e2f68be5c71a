"""Polygons of a shell that meet outside common vertices and edges (codes 303 and 306)."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.geometry.flat_arrays import first_equal_row
from envgen_usd.geometry.iso19107.coincident_points import places
from envgen_usd.geometry.iso19107.fault_codes import SNAP
from envgen_usd.geometry.plan_shapes import flat_shapes
from envgen_usd.geometry.polygon_planes import (
    flatten,
    next_in_ring,
    polygon_normals,
    polygon_of_point,
    ring_means,
)
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons

_PARALLEL = 1 - 1e-4
"""Least cosine between parallel normals; a larger value demands closer directions."""


@dataclass(frozen=True)
class _Planes:
    """Planes of P polygons: unit normals P x 3, and points P x 3 on the planes, metres."""

    normals: FloatArray
    places: FloatArray


def crossing_pairs(polygons: Polygons, group: IntArray) -> tuple[IntArray, IntArray]:
    """Returns pairs of polygons of a group that meet outside common vertices and edges.

    Intersections below `SNAP` do not count.

    Args:
        polygons: P polygons, flat and valid.
        group: P, group of each polygon, e.g. its shell.

    Returns:
        C x 2, pairs that intersect, touch or cover each other; and R x 2, pairs where an edge of
        the first connects two vertices of the second through the inside of the second.
    """
    if not len(polygons):
        return np.empty((0, 2), dtype=np.int64), np.empty((0, 2), dtype=np.int64)
    planes = _Planes(
        polygon_normals(polygons),
        ring_means(polygons.points, polygons.ring_offsets)[polygons.polygon_offsets[:-1]],
    )
    place = places(polygons.points)
    boxes = _boxes(polygons)
    hits, resting = _edges_through(polygons, planes, place, group, boxes)
    flat_pairs = _coplanar(planes, boxes, group)
    flat_pairs = flat_pairs[~_rims(polygons, place, flat_pairs)]
    covered = flat_pairs[_overlap(polygons, planes, flat_pairs)]
    pairs = np.sort(np.concatenate([hits, covered]), axis=1)
    return np.unique(pairs, axis=0), np.unique(resting, axis=0)


def _boxes(polygons: Polygons) -> tuple[FloatArray, FloatArray]:
    """Returns the lowest and highest coordinates of polygons, P x 3 each, metres."""
    starts = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    low = np.minimum.reduceat(polygons.points, starts, axis=0)
    return low, np.maximum.reduceat(polygons.points, starts, axis=0)


def _meeting(
    low: FloatArray, high: FloatArray, boxes: tuple[FloatArray, FloatArray]
) -> tuple[IntArray, IntArray]:
    """Returns indices of boxes (given by their corners) and of polygons that overlap them."""
    areas = shapely.box(boxes[0][:, 0], boxes[0][:, 1], boxes[1][:, 0], boxes[1][:, 1])
    asked = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    box, polygon = shapely.STRtree(areas).query(asked)
    meet = (low[box, 2] <= boxes[1][polygon, 2]) & (boxes[0][polygon, 2] <= high[box, 2])
    return box[meet], polygon[meet]


def _edges_through(
    polygons: Polygons,
    planes: _Planes,
    place: IntArray,
    group: IntArray,
    boxes: tuple[FloatArray, FloatArray],
) -> tuple[IntArray, IntArray]:
    """Returns pairs of polygons where an edge or vertex of the first lies inside the second.

    In the second array, both ends of the edge are vertices of the second polygon.
    """
    points, following = polygons.points, next_in_ring(polygons.ring_offsets)
    low = np.minimum(points, points[following]) - SNAP
    high = np.maximum(points, points[following]) + SNAP
    start, other = _meeting(low, high, boxes)
    owner = polygon_of_point(polygons)
    keep = (owner[start] != other) & (group[owner[start]] == group[other])
    start, other = start[keep], other[keep]
    end = following[start]
    normal, foot = planes.normals[other], planes.places[other]
    d_start = np.einsum("ij,ij->i", points[start] - foot, normal)
    d_end = np.einsum("ij,ij->i", points[end] - foot, normal)
    shared_start, shared_end = _shared(polygons, place, other, start, end)
    cuts = (np.minimum(d_start, d_end) < -SNAP) & (np.maximum(d_start, d_end) > SNAP)
    cuts &= ~shared_start & ~shared_end
    flat = np.abs(_dot(planes.normals[owner[start]], normal)) > _PARALLEL
    touches = (np.abs(d_start) <= SNAP) & ~shared_start & ~flat
    share = np.divide(d_start, d_start - d_end, out=np.zeros_like(d_start), where=cuts)
    where = points[start] + share[:, None] * (points[end] - points[start])
    rests = shared_start & shared_end
    where[rests] = (points[start[rests]] + points[end[rests]]) / 2
    chosen = np.flatnonzero(cuts | touches | rests)
    inside = chosen[_strictly_inside(polygons, planes, where[chosen], other[chosen])]
    pairs = np.column_stack([owner[start], other])
    return pairs[inside[~rests[inside]]], pairs[inside[rests[inside]]]


def _coplanar(planes: _Planes, boxes: tuple[FloatArray, FloatArray], group: IntArray) -> IntArray:
    """Returns coplanar pairs (i < j) of a group with overlapping boxes."""
    first, second = _meeting(*boxes, boxes)
    keep = (first < second) & (group[first] == group[second])
    first, second = first[keep], second[keep]
    parallel = np.abs(_dot(planes.normals[first], planes.normals[second])) > _PARALLEL
    apart = np.abs(_dot(planes.places[first] - planes.places[second], planes.normals[second]))
    return np.column_stack([first, second])[parallel & (apart <= 2 * SNAP)]


def _rims(polygons: Polygons, place: IntArray, pairs: IntArray) -> BoolArray:
    """Returns whether a polygon of each pair (C x 2) shares all its edges with the other's holes.

    In a closed shell it then fills that hole, because each edge has two polygons.
    """
    end = place[next_in_ring(polygons.ring_offsets)]
    owner = polygon_of_point(polygons)
    is_exterior = np.zeros(len(polygons.ring_offsets) - 1, dtype=bool)
    is_exterior[polygons.polygon_offsets[:-1]] = True
    in_hole = ~np.repeat(is_exterior, np.diff(polygons.ring_offsets))
    edge = first_equal_row(np.column_stack([np.minimum(place, end), np.maximum(place, end)]))
    order = np.lexsort([in_hole, edge])
    first, second = order[:-1], order[1:]
    pair = (edge[first] == edge[second]) & in_hole[second] & ~in_hole[first]
    beside = owner[first[pair]] * len(polygons) + owner[second[pair]]
    known, counts = np.unique(beside, return_counts=True)
    sizes = np.bincount(owner, minlength=len(polygons))
    rims: BoolArray = np.zeros(len(pairs), dtype=bool)
    for filling, holed in (pairs.T, pairs.T[::-1]):
        at = np.searchsorted(known, filling * len(polygons) + holed)
        at = np.minimum(at, len(known) - 1)
        if len(known):
            shares = known[at] == filling * len(polygons) + holed
            rims |= shares & (counts[at] == sizes[filling])
    return rims


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    dot: FloatArray = np.einsum("ij,ij->i", first, second)
    return dot


def _shared(
    polygons: Polygons, place: IntArray, other: IntArray, *points: IntArray
) -> list[BoolArray]:
    """Returns whether each point (M) is a vertex of the other polygon (M)."""
    count = len(polygons.points)
    known = np.unique(polygon_of_point(polygons) * count + place)
    asked = [other * count + place[point] for point in points]
    return [known[np.minimum(np.searchsorted(known, a), len(known) - 1)] == a for a in asked]


def _strictly_inside(
    polygons: Polygons, planes: _Planes, points: FloatArray, polygon: IntArray
) -> BoolArray:
    """Returns whether points (M x 3) in the planes of polygons (M) lie strictly inside them."""
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
    """Returns whether coplanar polygons (C x 2) overlap."""
    overlap: BoolArray = np.zeros(len(pairs), dtype=bool)
    owner = polygon_of_point(polygons)
    # Both polygons are projected along the same axis; pairs are processed axis by axis.
    axis = np.abs(planes.normals).argmax(axis=1)[pairs[:, 1]]
    for direction in np.unique(axis).tolist():
        chosen = np.flatnonzero(axis == direction)
        names, place = np.unique(pairs[chosen], return_inverse=True)
        along = np.broadcast_to(np.eye(3)[direction], (len(owner), 3))
        shapes = flat_shapes(polygons, flatten(polygons.points, along), names)
        first, second = shapes[place.reshape(-1, 2)].T
        common = shapely.area(shapely.intersection(first, second))
        overlap[chosen] = common > SNAP * (shapely.length(first) + shapely.length(second)) / 2
    return overlap
