"""Triangles of polygons with holes, that use the polygons' own vertices."""

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.collections import first_equal_row
from envgen_usd.geometry.planes import flat_coordinates, polygon_of_point
from envgen_usd.geometry.shapes import flat_shapes
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.polygons import Polygons


def triangulate(polygons: Polygons) -> tuple[IntArray, IntArray]:
    """Cuts polygons into triangles without new vertices.

    Every edge of a polygon stays an edge of its triangles, also where vertices lie on a straight
    line; surfaces that share their vertices therefore stay watertight. Triangles and four-sided
    polygons are cut at once, others by the constrained Delaunay triangulation of their picture
    along the axis nearest to the normal. A polygon whose picture is not simple is cut into a fan
    about its first vertex, without its holes.

    Args:
        polygons: P polygons; flat, or nearly so.

    Returns:
        T x 3, rows of ``polygons.points``, in the sense of rotation of the exterior; and T, the
        polygon that each triangle belongs to, ascending.
    """
    flat = flat_coordinates(polygons)
    rings = np.diff(polygons.polygon_offsets)
    first = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    sizes = polygons.ring_offsets[polygons.polygon_offsets[:-1] + 1] - first
    threes = np.flatnonzero((rings == 1) & (sizes == 3))
    fours = np.flatnonzero((rings == 1) & (sizes == 4))
    quads, simple = _cut_quads(flat, first[fours])
    uncut = sizes > 3
    uncut[fours[simple]] = False
    others, owner = _cut_any(polygons, flat, np.flatnonzero(uncut | ((sizes == 3) & (rings > 1))))
    triangles = np.concatenate([first[threes, None] + np.arange(3), quads, others])
    owners = np.concatenate([threes, np.repeat(fours[simple], 2), owner])
    order = np.argsort(owners, kind="stable")
    return triangles[order], owners[order]


def _cut_quads(flat: FloatArray, first: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles 2 S x 3 of the simple ones of Q four-sided polygons, and which (S) those are."""
    corners = flat[first[:, None] + np.arange(4)]  # Q x 4 x 2
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(ahead, 1, axis=1)
    turns = behind[..., 0] * ahead[..., 1] - behind[..., 1] * ahead[..., 0]
    # The diagonal 0-2 leaves the corners 1 and 3 as the tips of its triangles.
    even = np.minimum(turns[:, 1], turns[:, 3])
    odd = np.minimum(turns[:, 0], turns[:, 2])
    local = np.where((even >= odd)[:, None], [0, 1, 2, 0, 2, 3], [1, 2, 3, 1, 3, 0])
    simple = np.flatnonzero(np.maximum(even, odd) > 0)
    return (first[:, None] + local)[simple].reshape(-1, 3), simple


def _cut_any(polygons: Polygons, flat: FloatArray, chosen: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles T x 3 of the chosen polygons, and the polygon of each."""
    if not len(chosen):
        return np.empty((0, 3), dtype=np.int64), np.empty(0, dtype=np.int64)
    corners, shape = _delaunay(flat_shapes(polygons, flat, chosen))
    owner = chosen[shape]
    found = _match(flat, polygon_of_point(polygons), corners, owner)
    fans = np.setdiff1d(chosen, owner)
    pieces = [_fan(polygons, p) for p in fans.tolist()]
    fan_owner = np.repeat(fans, np.array([len(piece) for piece in pieces], dtype=np.int64))
    return np.concatenate([found, *pieces]), np.concatenate([owner, fan_owner])


def _delaunay(shapes: NDArray[np.object_]) -> tuple[FloatArray, IntArray]:
    """Triangles T x 3 x 2, counter-clockwise, and the shape of each; none for shapes not simple."""
    try:
        cut = shapely.constrained_delaunay_triangles(shapes)
    except shapely.GEOSException:
        cut = np.array([_delaunay_of_one(shape) for shape in shapes], dtype=object)
    parts, owner = shapely.get_parts(cut, return_index=True)
    corners: FloatArray = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = one[:, 0] * two[:, 1] < one[:, 1] * two[:, 0]
    corners[clockwise] = corners[clockwise][:, ::-1]
    return corners, owner


def _delaunay_of_one(shape: shapely.Polygon) -> shapely.Geometry:
    try:
        return shapely.constrained_delaunay_triangles(shape)
    except shapely.GEOSException:
        return shapely.GeometryCollection()


def _match(
    flat: FloatArray, point_owner: IntArray, corners: FloatArray, owner: IntArray
) -> IntArray:
    """Points, T x 3, of the same polygon that lie exactly where the corners do."""
    known = np.flatnonzero(np.isin(point_owner, owner))
    keys = np.concatenate(
        [
            np.column_stack([point_owner[known], flat[known]]),
            np.column_stack([np.repeat(owner, 3), corners.reshape(-1, 2)]),
        ]
    )
    place = first_equal_row(keys)[len(known) :]
    matched: IntArray = known[place].reshape(-1, 3)
    return matched


def _fan(polygons: Polygons, polygon: int) -> IntArray:
    first = polygons.polygon_offsets[polygon]
    start, end = polygons.ring_offsets[first : first + 2]
    spokes = np.arange(start + 1, end - 1)
    return np.column_stack([np.full(len(spokes), start), spokes, spokes + 1])
