"""Triangulates polygons with holes without new vertices."""

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.flat_arrays import first_equal_row
from envgen_usd.geometry.plan_shapes import flat_shapes
from envgen_usd.geometry.polygon_planes import flat_coordinates, polygon_of_point
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons


def triangulate(polygons: Polygons) -> tuple[IntArray, IntArray]:
    """Triangulates polygons without new vertices.

    Each polygon edge remains a triangle edge, also with collinear vertices. Surfaces with common
    vertices therefore stay watertight. Triangles and quads are processed in bulk. Other polygons
    are triangulated by constrained Delaunay in their projection along the axis nearest to the
    normal. A polygon with a projection that is not simple becomes a fan around its first vertex,
    without its holes.

    Args:
        polygons: P polygons, flat or nearly flat.

    Returns:
        T x 3, rows of ``polygons.points``, oriented as the exterior; and T, polygon of each
        triangle, ascending.
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
    """Triangulates the S simple quads of Q quads into 2 S triangles; returns the indices S too."""
    corners = flat[first[:, None] + np.arange(4)]  # Q x 4 x 2
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(ahead, 1, axis=1)
    turns = behind[..., 0] * ahead[..., 1] - behind[..., 1] * ahead[..., 0]
    # The diagonal 0-2 separates the corners 1 and 3.
    even = np.minimum(turns[:, 1], turns[:, 3])
    odd = np.minimum(turns[:, 0], turns[:, 2])
    local = np.where((even >= odd)[:, None], [0, 1, 2, 0, 2, 3], [1, 2, 3, 1, 3, 0])
    simple = np.flatnonzero(np.maximum(even, odd) > 0)
    return (first[:, None] + local)[simple].reshape(-1, 3), simple


def _cut_any(polygons: Polygons, flat: FloatArray, chosen: IntArray) -> tuple[IntArray, IntArray]:
    """Returns triangles T x 3 of the chosen polygons, and the polygon of each."""
    if not len(chosen):
        return np.empty((0, 3), dtype=np.int64), np.empty(0, dtype=np.int64)
    corners, shape = _delaunay(flat_shapes(polygons, flat, chosen))
    owner = chosen[shape]
    rows = _match(flat, polygon_of_point(polygons), corners, owner)
    fans = np.setdiff1d(chosen, owner)
    pieces = [_fan(polygons, p) for p in fans.tolist()]
    fan_owner = np.repeat(fans, np.array([len(piece) for piece in pieces], dtype=np.int64))
    return np.concatenate([rows, *pieces]), np.concatenate([owner, fan_owner])


def _delaunay(shapes: NDArray[np.object_]) -> tuple[FloatArray, IntArray]:
    """Returns triangles T x 3 x 2, counter-clockwise, with their shapes; only of simple shapes."""
    try:
        cut = shapely.constrained_delaunay_triangles(shapes)
    except shapely.GEOSException:
        cut = np.array([_delaunay_of_one(shape) for shape in shapes], dtype=object)
    parts, owner = shapely.get_parts(cut, return_index=True)
    corners: FloatArray = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    edge, diagonal = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = edge[:, 0] * diagonal[:, 1] < edge[:, 1] * diagonal[:, 0]
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
    """Returns the points, T x 3, of the same polygon that coincide exactly with the corners."""
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
