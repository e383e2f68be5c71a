"""Faults of shells: topology and orientation (codes 301, 302, 303, 305, 307, 405)."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.flat_arrays import first_equal_row
from envgen_usd.geometry.iso19107.coincident_points import linked, places
from envgen_usd.geometry.iso19107.fault_codes import Fault
from envgen_usd.geometry.polygon_planes import (
    next_in_ring,
    polygon_of_point,
    polygon_of_ring,
    ring_areas,
    ring_means,
)
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons


@dataclass(frozen=True)
class _Edges:
    """Directed edges of polygons' rings: edge n starts at point n.

    Attributes:
        start: N, vertex at the start; coincident points of a shell form a vertex.
        end: N, vertex at the end.
        twin: N, the first edge between the same two vertices, in either direction.
        forward: N, number of edges between them from the lower to the higher vertex.
        backward: N, number of edges between them in the opposite direction.
    """

    start: IntArray
    end: IntArray
    twin: IntArray
    forward: IntArray
    backward: IntArray


def shell_faults(
    polygons: Polygons, shell: IntArray, inner: BoolArray, may_open: BoolArray
) -> list[Fault]:
    """Returns the faults of shells.

    Args:
        polygons: P valid polygons.
        shell: P, shell of each polygon, counted from 0.
        inner: S, whether a shell bounds a cavity; its normals then point into the cavity.
        may_open: S, whether a shell is a surface without volume, which may be open.
    """
    edges = _edges(polygons, shell)
    owner = polygon_of_point(polygons)
    uses = edges.forward + edges.backward
    closed = uses == 2
    rim = (uses == 1) & ~may_open[shell[owner]]
    faults = [
        *_few_polygons(shell, may_open),
        *_fault_per_shell(302, owner[rim], shell, "an edge with a single polygon"),
        *_fault_per_shell(303, owner[uses > 2], shell, "an edge with more than two polygons"),
        *_fault_per_shell(
            303, owner[_split_vertices(polygons, edges)], shell, "a vertex joins two fans"
        ),
        *_fault_per_shell(
            307,
            owner[closed & (edges.forward != 1)],
            shell,
            "an edge with equal directions in both polygons",
        ),
        *_components(owner, edges, shell),
    ]
    unsigned = {fault.shell for fault in faults} | set(np.flatnonzero(may_open).tolist())
    return faults + _inward(polygons, shell, inner, unsigned)


def _edges(polygons: Polygons, shell: IntArray) -> _Edges:
    owner = polygon_of_point(polygons)
    vertex = first_equal_row(np.column_stack([shell[owner], places(polygons.points)]))
    end = vertex[next_in_ring(polygons.ring_offsets)]
    twin = first_equal_row(np.column_stack([np.minimum(vertex, end), np.maximum(vertex, end)]))
    up = vertex < end
    forward = np.bincount(twin[up], minlength=len(vertex))[twin]
    backward = np.bincount(twin[~up], minlength=len(vertex))[twin]
    return _Edges(vertex, end, twin, forward, backward)


def _few_polygons(shell: IntArray, may_open: BoolArray) -> list[Fault]:
    names, counts = np.unique(shell[~may_open[shell]], return_counts=True)
    return [
        Fault(301, -1, int(name), f"{count} polygons")
        for name, count in zip(names[counts < 4], counts[counts < 4], strict=True)
    ]


def _fault_per_shell(code: int, polygons: IntArray, shell: IntArray, detail: str) -> list[Fault]:
    """Returns a fault for each shell with its first polygon and the number of polygons."""
    polygons = np.unique(polygons)
    shells, first, counts = np.unique(shell[polygons], return_index=True, return_counts=True)
    return [
        Fault(code, int(polygons[f]), int(s), f"{detail} ({n} polygons)")
        for s, f, n in zip(shells, first, counts, strict=True)
    ]


def _split_vertices(polygons: Polygons, edges: _Edges) -> BoolArray:
    """Returns whether the polygon corners (N) at each vertex form several fans around it."""
    corners = np.arange(len(edges.start))
    next_corner = next_in_ring(polygons.ring_offsets)
    low_corner = np.where(edges.start < edges.end, corners, next_corner)
    high_corner = np.where(edges.start < edges.end, next_corner, corners)
    # A polygon has several corners at a vertex where its rings touch.
    same = first_equal_row(np.column_stack([polygon_of_point(polygons), edges.start]))
    # Two polygons at an edge have adjacent corners at both ends of it.
    first = np.concatenate([low_corner[edges.twin], high_corner[edges.twin], same])
    second = np.concatenate([low_corner, high_corner, corners])
    fans = linked(len(corners), first, second)
    fan = first_equal_row(np.column_stack([edges.start, fans])) == corners
    split: BoolArray = np.bincount(edges.start[fan], minlength=len(corners))[edges.start] > 1
    return split


def _components(owner: IntArray, edges: _Edges, shell: IntArray) -> list[Fault]:
    pieces = linked(len(shell), owner, owner[edges.twin])
    first = first_equal_row(pieces[:, None]) == np.arange(len(shell))
    shells, counts = np.unique(shell[first], return_counts=True)
    return [
        Fault(305, -1, int(s), f"{n} pieces")
        for s, n in zip(shells[counts > 1], counts[counts > 1], strict=True)
    ]


def volumes(polygons: Polygons, shell: IntArray) -> FloatArray:
    """Returns the signed volume of each shell, cubic metres.

    The volume is positive if normals point outwards. By the divergence theorem it is a third of
    the sum of (area) x (distance of the plane from a fixed point).

    Args:
        polygons: P polygons.
        shell: P, shell of each polygon, counted from 0.
    """
    areas = np.zeros((len(polygons), 3))
    np.add.at(areas, polygon_of_ring(polygons), ring_areas(polygons.points, polygons.ring_offsets))
    means = ring_means(polygons.points, polygons.ring_offsets)[polygons.polygon_offsets[:-1]]
    # The fixed point is a point of the shell, because digits are lost far from the origin.
    first = first_equal_row(shell[:, None])
    heights = np.einsum("ij,ij->i", areas, means - means[first])
    volume: FloatArray = np.bincount(shell, weights=heights) / 3
    return volume


def _inward(
    polygons: Polygons, shell: IntArray, inner: BoolArray, unsigned: set[int]
) -> list[Fault]:
    """Returns fault 405 of shells with an orientation, all but the unsigned."""
    volume = volumes(polygons, shell)
    wrong = np.where(inner[: len(volume)], volume >= 0, volume <= 0)
    return [
        Fault(405, -1, int(s), f"volume {volume[s]:.3f} m³")
        for s in np.unique(shell)
        if int(s) not in unsigned and wrong[s]
    ]
