"""Solids above areas of any shape, and above strips that cross themselves."""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from envgen_usd.chunks import GRID, snap
from envgen_usd.city.roads.traffic_solids import raise_solid
from envgen_usd.geometry.flat_arrays import join, take
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.polygon_planes import next_in_ring, polygon_of_point, ring_areas
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.geometry.unique_rows import unique_rows
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons

_EROSIONS = (0.0, 0.005, 0.02)
"""Metres by which an area shrinks where it touches itself; the first without faults counts."""
_LEAST_AREA = 0.01
"""Area in plan in square metres below which there is no space."""
_LEAST_PART = 0.1
"""Area in plan in square metres of a part with a space of its own."""


def connected_parts(areas: Polygons) -> list[Polygons]:
    """Splits polygons into parts that edges connect, largest first.

    Parts below `_LEAST_PART` stay with the largest, so that all polygons remain.
    """
    if len(areas) < 2:
        return [areas]
    labels = _labels(areas)
    sizes = np.bincount(labels, _plan_areas(areas))
    order = np.argsort(-sizes, kind="stable").tolist()
    kept = [label for place, label in enumerate(order) if place == 0 or sizes[label] >= _LEAST_PART]
    owner = np.where(np.isin(labels, kept), labels, kept[0])
    return [take(areas, np.flatnonzero(owner == label)) for label in kept]


def area_solids(areas: Sequence[Polygons], heights: Sequence[float]) -> list[Polygons | None]:
    """Returns the closed shells of the spaces above areas whose polygons face up.

    Args:
        areas: Connected polygons each; where they touch themselves, the space shrinks by
            millimetres.
        heights: Height of each space, metres.

    Returns:
        The shells; `None` for an area that is too narrow for a valid solid.
    """
    raised = [raise_solid(each, height) for each, height in zip(areas, heights, strict=True)]
    sizes = [len(solid) for solid in raised]
    owner = np.repeat(np.arange(len(raised)), sizes)
    faults = find_faults(Bodies(join(raised), owner, np.arange(len(raised))))
    faulty = {fault.shell for fault in faults}
    return [
        _shrunk(areas[number], heights[number]) if number in faulty else solid
        for number, solid in enumerate(raised)
    ]


def _shrunk(areas: Polygons, height: float) -> Polygons | None:
    corners = areas.points[triangulate(areas)[0]]
    return _above(shapely.polygons(corners[..., :2]), areas.points, height)


def hull_solid(areas: Polygons, height: float) -> Polygons | None:
    """Returns the closed shell of the space above the convex hull of polygons in plan."""
    hull = shapely.convex_hull(shapely.multipoints(areas.points[:, :2]))
    return _above(np.array([hull]), areas.points, height)


def strip_solid(left: FloatArray, right: FloatArray, height: float) -> Polygons | None:
    """Returns the closed shell of the space above a strip that may cross itself.

    Args:
        left: N x 3, left border, metres.
        right: N x 3, right border, metres.
        height: Height of the space, metres.

    Returns:
        The shell above the largest connected part; `None` if the strip has no area.
    """
    quads = np.stack([left[:-1], right[:-1], right[1:], left[1:]], axis=1)[..., :2]
    pieces = shapely.make_valid(shapely.polygons(quads))
    return _above(pieces, np.concatenate([left, right]), height)


def _above(pieces: NDArray[np.object_], points: FloatArray, height: float) -> Polygons | None:
    """Returns the shell above the union of pieces in plan, at the heights of the nearest points."""
    # Closing removes slits between pieces that meet within the grid.
    whole = shapely.union_all(pieces).buffer(GRID, join_style="mitre")
    whole = whole.buffer(-GRID, join_style="mitre")
    tree = cKDTree(points[:, :2])
    for erosion in _EROSIONS:
        shrunk = whole.buffer(-erosion, join_style="mitre") if erosion else whole
        # Spikes of mitres may cross themselves.
        shrunk = shapely.make_valid(shrunk)
        part = max(shapely.get_parts(shrunk), key=shapely.area, default=None)
        if part is None or part.area < _LEAST_AREA:
            return None
        corners = _triangles(shapely.set_precision(part, GRID))
        places = tree.query(corners.reshape(-1, 2))[1]
        lifted = np.column_stack([corners.reshape(-1, 2), points[places, 2]])
        areas = Polygons.of_triangles(snap(lifted), np.arange(len(lifted)).reshape(-1, 3))
        solid = raise_solid(areas, height)
        if len(areas) and not find_faults(Bodies.of_solid(solid)):
            return solid
    return None


def _triangles(shape: shapely.Geometry) -> FloatArray:
    """Triangles of an area in plan, T x 3 x 2, counter-clockwise."""
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    corners = np.array([shapely.get_coordinates(each)[:3] for each in triangles]).reshape(-1, 3, 2)
    a, b, c = corners.transpose(1, 0, 2)
    turned = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0
    corners[turned] = corners[turned][:, ::-1]
    return corners


def _labels(areas: Polygons) -> IntArray:
    """Connected part of each polygon; common edges connect."""
    _, points = unique_rows(areas.points)
    following = points[next_in_ring(areas.ring_offsets)]
    edges = np.sort(np.column_stack([points, following]), axis=1)
    owner = polygon_of_point(areas)
    _, edge = unique_rows(edges)
    order = np.argsort(edge, kind="stable")
    same = edge[order][1:] == edge[order][:-1]
    pairs = owner[order][1:][same], owner[order][:-1][same]
    graph = coo_array((np.ones(len(pairs[0])), pairs), shape=(len(areas), len(areas)))
    labels: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def _plan_areas(areas: Polygons) -> FloatArray:
    """Area of each polygon in plan, square metres."""
    rings = ring_areas(areas.points, areas.ring_offsets)[:, 2]
    owner = np.repeat(np.arange(len(areas)), np.diff(areas.polygon_offsets))
    return np.abs(np.bincount(owner, rings, minlength=len(areas)))
