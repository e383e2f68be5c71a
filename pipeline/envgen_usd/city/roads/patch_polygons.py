"""Merges coplanar triangles of the road surface into polygons with every shared vertex."""

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from envgen_usd.geometry.border_loops import border_loops
from envgen_usd.geometry.iso19107.polygon_faults import polygon_faults
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons

FLAT = 5e-4
"""Largest distance of vertices from a common plane, metres; a larger value merges more triangles.

"""
_UPRIGHT = 1e-9


def patch_polygons(vertices: FloatArray, triangles: IntArray) -> Polygons:
    """Returns polygons that cover the same surface as triangles.

    Connected coplanar triangles become a single polygon with holes. It keeps all vertices of its
    border, also collinear vertices, because neighbours may end there. So the surface stays
    watertight. Other triangles remain.

    Args:
        vertices: V x 3, metres.
        triangles: T x 3, indices into `vertices`.
    """
    edges, owners = _edges(triangles)
    pieces = _pieces(edges, owners, len(triangles))
    order = np.argsort(pieces, kind="stable")
    members = np.split(order, np.flatnonzero(np.diff(pieces[order])) + 1)
    borders = [_merged(vertices, triangles, chosen, edges, owners) for chosen in members]
    merged = [number for number, loops in enumerate(borders) if loops]
    # Rounding tilts the area between almost touching vertices: such pieces stay apart.
    for fault in polygon_faults(_polygons(vertices, [borders[number] for number in merged])):
        borders[merged[fault.polygon]] = []
    rings: list[list[IntArray]] = []
    for chosen, loops in zip(members, borders, strict=True):
        rings += [loops] if loops else [[triangle] for triangle in triangles[chosen]]
    return _polygons(vertices, rings)


def _merged(
    vertices: FloatArray,
    triangles: IntArray,
    chosen: IntArray,
    edges: IntArray,
    owners: IntArray,
) -> list[IntArray]:
    """Loops of a piece, exterior first; empty if the piece is not a single polygon."""
    if len(chosen) < 2 or not _is_flat(vertices, triangles[chosen]):
        return []
    border = border_loops((a, b) for a, b in edges[np.isin(owners, chosen)].tolist())
    loops = [np.array(loop, dtype=np.int64) for loop in border or ()]
    if not loops or not _is_simple(vertices, loops):
        return []
    return _exterior_first(vertices, loops)


def _edges(triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Directed edges, 3T x 2, and the triangle of each."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return edges, np.tile(np.arange(len(triangles)), 3)


def _pieces(edges: IntArray, owners: IntArray, count: int) -> IntArray:
    """Connected component of each triangle; edges connect triangles."""
    ordered = np.sort(edges, axis=1)
    order = np.lexsort((ordered[:, 1], ordered[:, 0]))
    same = (ordered[order][1:] == ordered[order][:-1]).all(axis=1)
    first, second = owners[order][1:][same], owners[order][:-1][same]
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    labels: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def _is_flat(vertices: FloatArray, triangles: IntArray) -> bool:
    points = vertices[np.unique(triangles)]
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    length = float(np.linalg.norm(normal))
    if length < _UPRIGHT:
        return False
    distances = (points - points.mean(axis=0)) @ (normal / length)
    return bool(np.abs(distances).max() <= FLAT)


def _is_simple(vertices: FloatArray, loops: list[IntArray]) -> bool:
    """True if loops do not cross themselves in plan; also true for vertical pieces."""
    exterior, *holes = (vertices[loop][:, :2] for loop in _exterior_first(vertices, loops))
    if np.ptp(exterior, axis=0).min() < _UPRIGHT or shapely.Polygon(exterior).area < _UPRIGHT:
        return True
    return bool(shapely.Polygon(exterior, holes).is_valid)


def _exterior_first(vertices: FloatArray, loops: list[IntArray]) -> list[IntArray]:
    """Moves the loop with the largest extent, the exterior, to the front."""
    spans = [float(np.ptp(vertices[loop], axis=0).max()) for loop in loops]
    first = int(np.argmax(spans))
    return [loops[first], *loops[:first], *loops[first + 1 :]]


def _polygons(vertices: FloatArray, polygons: list[list[IntArray]]) -> Polygons:
    rings = [ring for loops in polygons for ring in loops]
    points = vertices[np.concatenate(rings)] if rings else np.empty((0, 3))
    return Polygons(
        points,
        np.cumsum([0, *(len(ring) for ring in rings)], dtype=np.int64),
        np.cumsum([0, *(len(loops) for loops in polygons)], dtype=np.int64),
    )
