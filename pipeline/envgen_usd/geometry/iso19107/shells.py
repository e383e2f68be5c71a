"""Shells: topology and orientation (codes 301, 302, 303, 305, 307, 405)."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.collections import first_equal_row
from envgen_usd.geometry.iso19107.faults import Fault
from envgen_usd.geometry.iso19107.places import linked, places
from envgen_usd.geometry.planes import (
    next_in_ring,
    polygon_of_point,
    polygon_of_ring,
    ring_areas,
    ring_means,
)
from envgen_usd.models.arrays import BoolArray, FloatArray, IntArray
from envgen_usd.models.polygons import Polygons


@dataclass(frozen=True)
class _Edges:
    """Directed edges of polygons' rings: edge n starts at point n.

    Attributes:
        start: N, vertex (equal points of a shell are one vertex) where it starts.
        end: N, vertex where it ends.
        twin: N, the first edge between the same two vertices, whatever its direction.
        forward: N, how many edges run from the lower to the higher vertex here.
        backward: N, how many run the other way.
    """

    start: IntArray
    end: IntArray
    twin: IntArray
    forward: IntArray
    backward: IntArray


def shell_faults(polygons: Polygons, shell: IntArray, inner: BoolArray) -> list[Fault]:
    """Returns what is wrong with the shells that polygons form.

    Args:
        polygons: P polygons, valid ones.
        shell: P, the shell of each, from 0 on.
        inner: S, whether a shell bounds a cavity, so that its normals point into it.
    """
    edges = _edges(polygons, shell)
    owner = polygon_of_point(polygons)
    uses = edges.forward + edges.backward
    closed = uses == 2
    found = [
        *_few_polygons(shell),
        *_one_each(302, owner[uses == 1], shell, "an edge with one polygon"),
        *_one_each(303, owner[uses > 2], shell, "an edge with more than two polygons"),
        *_one_each(303, owner[_split_vertices(polygons, edges)], shell, "a vertex joins two fans"),
        *_one_each(307, owner[closed & (edges.forward != 1)], shell, "runs as its neighbour does"),
        *_components(owner, edges, shell),
    ]
    return found + _inward(polygons, shell, inner, {fault.shell for fault in found})


def _edges(polygons: Polygons, shell: IntArray) -> _Edges:
    owner = polygon_of_point(polygons)
    vertex = first_equal_row(np.column_stack([shell[owner], places(polygons.points)]))
    end = vertex[next_in_ring(polygons.ring_offsets)]
    twin = first_equal_row(np.column_stack([np.minimum(vertex, end), np.maximum(vertex, end)]))
    up = vertex < end
    forward = np.bincount(twin[up], minlength=len(vertex))[twin]
    backward = np.bincount(twin[~up], minlength=len(vertex))[twin]
    return _Edges(vertex, end, twin, forward, backward)


def _few_polygons(shell: IntArray) -> list[Fault]:
    names, counts = np.unique(shell, return_counts=True)
    return [
        Fault(301, -1, int(name), f"{count} polygons")
        for name, count in zip(names[counts < 4], counts[counts < 4], strict=True)
    ]


def _one_each(code: int, polygons: IntArray, shell: IntArray, detail: str) -> list[Fault]:
    """One fault for each shell, with its first polygon and how many polygons are concerned."""
    polygons = np.unique(polygons)
    shells, first, counts = np.unique(shell[polygons], return_index=True, return_counts=True)
    return [
        Fault(code, int(polygons[f]), int(s), f"{detail} ({n} polygons)")
        for s, f, n in zip(shells, first, counts, strict=True)
    ]


def _split_vertices(polygons: Polygons, edges: _Edges) -> BoolArray:
    """Whether the polygons' corners (N) at each vertex are more than one fan about it."""
    corners = np.arange(len(edges.start))
    next_corner = next_in_ring(polygons.ring_offsets)
    low_corner = np.where(edges.start < edges.end, corners, next_corner)
    high_corner = np.where(edges.start < edges.end, next_corner, corners)
    # A polygon has several corners at a vertex where its rings touch.
    same = first_equal_row(np.column_stack([polygon_of_point(polygons), edges.start]))
    # Two polygons at an edge have neighbouring corners at both of its ends.
    one = np.concatenate([low_corner[edges.twin], high_corner[edges.twin], same])
    other = np.concatenate([low_corner, high_corner, corners])
    fans = linked(len(corners), one, other)
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
    """Returns the signed volume that each shell encloses, cubic metres.

    Positive where normals point outwards. By the divergence theorem it is a third of the sum of
    (area) x (distance of the plane from any fixed place).

    Args:
        polygons: P polygons.
        shell: P, the shell of each, from 0 on.
    """
    areas = np.zeros((len(polygons), 3))
    np.add.at(areas, polygon_of_ring(polygons), ring_areas(polygons.points, polygons.ring_offsets))
    means = ring_means(polygons.points, polygons.ring_offsets)[polygons.polygon_offsets[:-1]]
    # Each shell has its own fixed place, for far from the origin digits would be lost.
    first = first_equal_row(shell[:, None])
    heights = np.einsum("ij,ij->i", areas, means - means[first])
    volume: FloatArray = np.bincount(shell, weights=heights) / 3
    return volume


def _inward(polygons: Polygons, shell: IntArray, inner: BoolArray, faulty: set[int]) -> list[Fault]:
    volume = volumes(polygons, shell)
    wrong = np.where(inner[: len(volume)], volume >= 0, volume <= 0)
    return [
        Fault(405, -1, int(s), f"volume {volume[s]:.3f} m³")
        for s in np.unique(shell)
        if int(s) not in faulty and wrong[s]
    ]
