"""Faults of polygons: planarity and holes (codes 104 and 201 to 208)."""

from itertools import combinations

import numpy as np
import shapely

from envgen_usd.geometry.flat_arrays import take
from envgen_usd.geometry.iso19107.fault_codes import SNAP, Fault
from envgen_usd.geometry.plan_shapes import flat_shapes
from envgen_usd.geometry.polygon_planes import (
    flat_coordinates,
    next_in_ring,
    polygon_normals,
    polygon_of_point,
    ring_areas,
)
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.polygon_arrays import Polygons

DISTANCE = 0.01
"""Largest distance in metres of a point from the plane of its polygon."""
DEVIATION = 20.0
"""Largest angle in degrees between the normals of a polygon and of its triangles."""


def polygon_faults(polygons: Polygons) -> list[Fault]:
    """Returns the faults of polygons with valid rings."""
    if not len(polygons):
        return []
    holed = np.flatnonzero(np.diff(polygons.polygon_offsets) > 1)
    valid = shapely.is_valid(flat_shapes(polygons, flat_coordinates(polygons), holed))
    return [
        *(fault for p in holed[~valid].tolist() for fault in _hole_faults(polygons, p)),
        *_orientation_faults(polygons),
        *_flatness_faults(polygons),
    ]


def _hole_faults(polygons: Polygons, polygon: int) -> list[Fault]:
    """Returns faults 201, 202, 205, 206 and 207 of how an invalid polygon's rings are placed."""
    alone = take(polygons, np.array([polygon]))
    rings = np.split(flat_coordinates(alone), alone.ring_offsets[1:-1])
    exterior, *holes = (shapely.Polygon(ring) for ring in rings)
    codes = {_hole_in_exterior(exterior, hole) for hole in holes}
    codes |= {_two_holes(one, other) for one, other in combinations(holes, 2)}
    # Each pair of rings is valid, but together they split the interior.
    return [Fault(code, polygon) for code in sorted(codes - {0}) or [205]]


def _hole_in_exterior(exterior: shapely.Polygon, hole: shapely.Polygon) -> int:
    if exterior.equals(hole):
        return 202
    if shapely.relate_pattern(exterior, hole, "F********"):
        return 206
    pair = shapely.Polygon(exterior.exterior, [hole.exterior])
    if pair.is_valid:
        return 0
    touches_only = (
        exterior.covers(hole) and exterior.exterior.intersection(hole.exterior).length == 0
    )
    return 205 if touches_only else 201


def _two_holes(first: shapely.Polygon, second: shapely.Polygon) -> int:
    if first.equals(second):
        return 202
    meeting = first.exterior.intersection(second.exterior)
    apart = shapely.relate_pattern(first, second, "F********")
    if apart:
        return 0 if meeting.length == 0 else 201
    return 207 if first.covers(second) or second.covers(first) else 201


def _orientation_faults(polygons: Polygons) -> list[Fault]:
    areas = ring_areas(polygons.points, polygons.ring_offsets)
    owner = np.repeat(np.arange(len(polygons)), np.diff(polygons.polygon_offsets))
    same = np.einsum("ij,ij->i", areas, polygon_normals(polygons)[owner]) > 0
    same[polygons.polygon_offsets[:-1]] = False
    return [Fault(208, int(polygon)) for polygon in np.unique(owner[same])]


def _flatness_faults(polygons: Polygons) -> list[Fault]:
    """Returns faults 203, 104 and 204 of how flat polygons are, a single one for each polygon."""
    distance = _distances(polygons)
    angle = _deviations(polygons)
    bent = distance > DISTANCE
    steep = ~bent & _with_steep_edge(polygons)
    folded = ~bent & ~steep & (angle > DEVIATION)
    return [
        *(Fault(203, int(p), detail=f"{distance[p]:.3f} m") for p in np.flatnonzero(bent)),
        *(Fault(104, int(p), detail="an edge is normal to it") for p in np.flatnonzero(steep)),
        *(Fault(204, int(p), detail=f"{angle[p]:.1f} degrees") for p in np.flatnonzero(folded)),
    ]


def _distances(polygons: Polygons) -> FloatArray:
    """Returns the largest distance (P, metres) of a polygon's points from their best-fit plane."""
    owner = polygon_of_point(polygons)
    starts = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    count = np.bincount(owner)[:, None]
    near = polygons.points - (np.add.reduceat(polygons.points, starts, axis=0) / count)[owner]
    spread = np.add.reduceat(near[:, :, None] * near[:, None, :], starts, axis=0)
    # The plane's normal is the direction of the least spread of the points.
    normals = np.linalg.eigh(spread)[1][:, :, 0]
    apart = np.abs(np.einsum("ij,ij->i", near, normals[owner]))
    distance: FloatArray = np.maximum.reduceat(apart, starts)
    return distance


def _with_steep_edge(polygons: Polygons) -> BoolArray:
    """Returns whether an edge of each polygon (P) is a point in the polygon's plane."""
    owner = polygon_of_point(polygons)
    edges = polygons.points[next_in_ring(polygons.ring_offsets)] - polygons.points
    normals = polygon_normals(polygons)[owner]
    across = np.einsum("ij,ij->i", edges, normals)[:, None] * normals
    steep: BoolArray = np.zeros(len(polygons), dtype=bool)
    steep[owner[np.linalg.norm(edges - across, axis=1) < SNAP / 2]] = True
    return steep


def _deviations(polygons: Polygons) -> FloatArray:
    """Returns the largest angle (P, degrees) between the normals of a polygon and its triangles."""
    triangles, owner = triangulate(polygons)
    a, b, c = (polygons.points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    cosine = np.einsum("ij,ij->i", normals, polygon_normals(polygons)[owner])
    cosine = np.divide(cosine, lengths, out=np.ones_like(cosine), where=lengths > 0)
    angle: FloatArray = np.zeros(len(polygons))
    np.maximum.at(angle, owner, np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return angle
