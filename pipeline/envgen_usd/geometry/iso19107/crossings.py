"""Polygons of a shell that meet other than at common vertices and edges (code 306)."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.geometry.collections import first_equal_row
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
    if not len(polygons):
        return np.empty((0, 2), dtype=np.int64)
    planes = _Planes(
        polygon_normals(polygons),
        ring_means(polygons.points, polygons.ring_offsets)[polygons.polygon_offsets[:-1]],
    )
    place = places(polygons.points)
    boxes = _boxes(polygons)
    hits = _edges_through(polygons, planes, place, group, boxes)
    flat_pairs = _coplanar(planes, boxes, group)
    flat_pairs = flat_pairs[~_rims(polygons, place, flat_pairs)]
    covered = flat_pairs[_overlap(polygons, planes, flat_pairs)]
    found = np.sort(np.concatenate([hits, covered]), axis=1)
    unique: IntArray = np.unique(found, axis=0)
    return unique


def _boxes(polygons: Polygons) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest coordinates of polygons, each P x 3."""
    starts = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    low = np.minimum.reduceat(polygons.points, starts, axis=0)
    return low, np.maximum.reduceat(polygons.points, starts, axis=0)


def _meeting(
    low: FloatArray, high: FloatArray, boxes: tuple[FloatArray, FloatArray]
) -> tuple[IntArray, IntArray]:
    """Boxes (by their corners) and polygons whose boxes meet."""
    areas = shapely.box(boxes[0][:, 0], boxes[0][:, 1], boxes[1][:, 0], boxes[1][:, 1])
    asked = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    one, other = shapely.STRtree(areas).query(asked)
    meet = (low[one, 2] <= boxes[1][other, 2]) & (boxes[0][other, 2] <= high[one, 2])
    return one[meet], other[meet]


def _edges_through(
    polygons: Polygons,
    planes: _Planes,
    place: IntArray,
    group: IntArray,
    boxes: tuple[FloatArray, FloatArray],
) -> IntArray:
    """Pairs of polygons of which an edge or a vertex of the first lies inside the other."""
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
    chosen = np.flatnonzero(cuts | touches)
    inside = chosen[_strictly_inside(polygons, planes, where[chosen], other[chosen])]
    return np.column_stack([owner[start[inside]], other[inside]])


def _coplanar(planes: _Planes, boxes: tuple[FloatArray, FloatArray], group: IntArray) -> IntArray:
    """Pairs (i < j) of one group that lie in one plane, and whose boxes meet."""
    one, other = _meeting(*boxes, boxes)
    keep = (one < other) & (group[one] == group[other])
    one, other = one[keep], other[keep]
    parallel = np.abs(_dot(planes.normals[one], planes.normals[other])) > _PARALLEL
    apart = np.abs(_dot(planes.places[one] - planes.places[other], planes.normals[other]))
    return np.column_stack([one, other])[parallel & (apart <= 2 * SNAP)]


def _rims(polygons: Polygons, place: IntArray, pairs: IntArray) -> BoolArray:
    """Whether one of two polygons (C x 2) has all of its edges with holes of the other.

    In a closed shell it then fills that hole, for each edge has two polygons.
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


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    dot: FloatArray = np.einsum("ij,ij->i", one, other)
    return dot


def _shared(
    polygons: Polygons, place: IntArray, other: IntArray, *points: IntArray
) -> list[BoolArray]:
    """Whether each point (M) is a vertex of the other polygon (M)."""
    count = len(polygons.points)
    known = np.unique(polygon_of_point(polygons) * count + place)
    asked = [other * count + place[point] for point in points]
    return [known[np.minimum(np.searchsorted(known, a), len(known) - 1)] == a for a in asked]


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
