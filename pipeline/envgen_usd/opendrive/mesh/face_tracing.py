"""Traces the faces between the edges of a planar graph."""

from typing import NamedTuple

import numpy as np
import shapely

from envgen_usd.geometry.flat_arrays import ascending, spans
from envgen_usd.models.array_types import FloatArray, IntArray

_PRUNINGS = 8
"""Edges of a dangling path that are dropped at once; a larger value saves a second tracing."""


class Rings(NamedTuple):
    """K rings of F faces; a face's first ring is its shell, counter-clockwise, then its holes.

    Attributes:
        vertices: R, vertices ring by ring, without repeated last vertex.
        start: K + 1, start of each ring in ``vertices``.
        face: K, face of each ring, ascending.
    """

    vertices: IntArray
    start: IntArray
    face: IntArray


def trace_faces(points: IntArray, edges: IntArray) -> Rings:
    """Returns the rings of all bounded faces.

    Args:
        points: P x 2, grid units.
        edges: E x 2, indices into ``points``; edges meet at common ends only.
    """
    edges = _without_dangles(edges, len(points))
    if not len(edges):
        nothing = np.empty(0, dtype=np.int64)
        return Rings(nothing, np.zeros(1, dtype=np.int64), nothing)
    cycles, starts = _cycles(points, edges)
    half = len(edges)
    cycle = np.empty(2 * half, dtype=np.int64)
    cycle[cycles] = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    # An edge with the same face on both sides bounds none.
    bounds = cycle[:half] != cycle[half:]
    if not bounds.any():
        return Rings(cycles[:0], starts[:1], starts[:0])
    if not bounds.all():
        edges = edges[bounds]
        cycles, starts = _cycles(points, edges)
    vertices = np.concatenate([edges[:, 0], edges[:, 1]])[cycles]
    vertices, starts, owner = _simple_rings(vertices, starts, len(points))
    return _with_holes(points, vertices, starts, owner)


def _without_dangles(edges: IntArray, count: int) -> IntArray:
    """Drops most edges with an end that no other edge shares; those left over bound no face."""
    for _ in range(_PRUNINGS):
        shared = np.bincount(edges.ravel(), minlength=count)[edges] > 1
        kept = shared[:, 0] & shared[:, 1]
        if kept.all():
            break
        edges = edges[kept]
    return edges


def _cycles(points: IntArray, edges: IntArray) -> tuple[IntArray, IntArray]:
    """Returns the half-edges of all cycles with their face on the left, and the cycles' starts.

    Half-edge ``e`` runs along edge ``e``, half-edge ``E + e`` against it.
    """
    count = len(edges)
    start = np.concatenate([edges[:, 0], edges[:, 1]])
    step = (points[edges[:, 1]] - points[edges[:, 0]]).astype(np.float64)
    step = np.concatenate([step, -step])
    order = np.lexsort((np.arctan2(step[:, 1], step[:, 0]), start))
    first = np.flatnonzero(np.diff(start[order], prepend=-1))
    # The half-edge that leaves next clockwise; before the first around a vertex comes the last.
    before = np.roll(order, 1)
    before[first] = order[np.append(first[1:], len(order)) - 1]
    clockwise = np.empty(2 * count, dtype=np.int64)
    clockwise[order] = before
    following = clockwise[np.concatenate([np.arange(count, 2 * count), np.arange(count)])].tolist()
    return _walk(following)


def _walk(following: list[int]) -> tuple[IntArray, IntArray]:
    """Returns the cycles of a permutation one after another, and their starts."""
    passed = bytearray(len(following))
    cycles: list[int] = []
    starts = [0]
    for first in range(len(following)):
        if passed[first]:
            continue
        place = first
        while not passed[place]:
            passed[place] = 1
            cycles.append(place)
            place = following[place]
        starts.append(len(cycles))
    return np.array(cycles, dtype=np.int64), np.array(starts, dtype=np.int64)


def _simple_rings(
    vertices: IntArray, starts: IntArray, count: int
) -> tuple[IntArray, IntArray, IntArray]:
    """Splits rings at each vertex that they revisit; returns the ring that each comes from too."""
    sizes = np.diff(starts)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    codes = np.sort(owner * count + vertices)
    again = ascending(codes[1:][codes[1:] == codes[:-1]] // count)
    if not len(again):
        return vertices, starts, np.arange(len(sizes))
    kept = np.setdiff1d(np.arange(len(sizes)), again)
    parts = [vertices[spans(starts[kept], sizes[kept])]]
    lengths, owners = [sizes[kept]], [kept]
    for ring in again.tolist():
        loops = _loops(vertices[starts[ring] : starts[ring + 1]].tolist())
        parts += [np.array(loop, dtype=np.int64) for loop in loops]
        lengths.append(np.array([len(loop) for loop in loops]))
        owners.append(np.full(len(loops), ring))
    starts = np.concatenate([[0], np.cumsum(np.concatenate(lengths))])
    return np.concatenate(parts), starts, np.concatenate(owners)


def _loops(ring: list[int]) -> list[list[int]]:
    """Splits a ring into loops without revisited vertices."""
    loops: list[list[int]] = []
    path: list[int] = []
    place: dict[int, int] = {}
    for vertex in ring:
        if vertex in place:
            begin = place[vertex]
            loops.append(path[begin:])
            for gone in path[begin:]:
                del place[gone]
            del path[begin:]
        place[vertex] = len(path)
        path.append(vertex)
    return [*loops, path]


def _with_holes(points: IntArray, vertices: IntArray, starts: IntArray, owner: IntArray) -> Rings:
    """Assigns clockwise rings to the faces around them; drops those around everything."""
    area = _areas(points, vertices, starts)
    shell, hole = np.flatnonzero(area > 0), np.flatnonzero(area < 0)
    face = np.full(len(area), -1)
    face[shell] = np.arange(len(shell))
    of_cycle = np.full(owner.max(initial=-1) + 1, -1)
    of_cycle[owner[shell]] = np.arange(len(shell))
    face[hole] = of_cycle[owner[hole]]
    free = hole[face[hole] < 0]
    face[free] = _container(points, (vertices, starts), shell, free)
    rings = np.flatnonzero(face >= 0)
    rings = rings[np.lexsort((rings, area[rings] < 0, face[rings]))]
    sizes = np.diff(starts)[rings]
    return Rings(
        vertices[spans(starts[rings], sizes)],
        np.concatenate([[0], np.cumsum(sizes)]),
        face[rings],
    )


def _areas(points: IntArray, vertices: IntArray, starts: IntArray) -> IntArray:
    """Returns twice the signed area of rings."""
    following = np.arange(1, len(vertices) + 1)
    following[starts[1:] - 1] = starts[:-1]
    x, y = (points[vertices] - points.min(axis=0)).T
    areas: IntArray = np.add.reduceat(x * y[following] - x[following] * y, starts[:-1])
    return areas


def _container(
    points: IntArray, rings: tuple[IntArray, IntArray], shell: IntArray, free: IntArray
) -> IntArray:
    """Returns the smallest shell around each free ring, as a place in ``shell``; else -1."""
    vertices, starts = rings
    inside = np.full(len(free), -1)
    if len(free) < 2:
        return inside
    places = points[vertices[starts[free]]].astype(np.float64)
    tree = shapely.STRtree(shapely.points(places))
    shells = ring_polygons(points.astype(np.float64), rings, shell)
    around, ring = tree.query(shells, predicate="contains_properly")
    size = shapely.area(shells)[around]
    order = np.lexsort((around, -size))
    inside[ring[order]] = around[order]
    return inside


def ring_polygons(
    points: FloatArray, rings: tuple[IntArray, IntArray], chosen: IntArray
) -> shapely.GeometryType:
    """Returns polygons without holes from some rings."""
    vertices, starts = rings
    sizes = np.diff(starts)[chosen]
    corner = vertices[spans(starts[chosen], sizes)]
    owner = np.repeat(np.arange(len(chosen)), sizes)
    return shapely.polygons(shapely.linearrings(points[corner], indices=owner))
