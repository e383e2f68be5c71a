"""Kerbs: vertical faces between adjacent surfaces of different height."""

from collections import Counter

import numpy as np

from envgen_usd.models.array_types import IntArray
from envgen_usd.opendrive.mesh.surface_seams import Seams


def build_walls(seams: Seams) -> tuple[IntArray, IntArray]:
    """Closes the edges between surfaces of different height.

    A wall includes every surface height at its two ends, so that walls and surfaces share all
    vertices.

    Returns:
        Triangles that face the lower side, T x 3 x (vertex of the arrangement, height); and the
        edge of each triangle, T.
    """
    steps = np.flatnonzero((seams.left != seams.right).any(axis=1))
    heights = _heights_at_ends(seams, steps)
    triangles: list[list[tuple[int, int]]] = []
    owner: list[int] = []
    for edge in steps.tolist():
        wall = _wall(seams, edge, heights)
        triangles += wall
        owner += [edge] * len(wall)
    return np.array(triangles, dtype=np.int64).reshape(-1, 3, 2), np.array(owner, dtype=np.int64)


def saddles(seams: Seams) -> list[int]:
    """Returns the vertices where more than two walls would share a vertical edge."""
    steps = np.flatnonzero((seams.left != seams.right).any(axis=1))
    heights = _heights_at_ends(seams, steps)
    crossed: Counter[tuple[int, int]] = Counter()
    for edge in steps.tolist():
        for side, vertex in enumerate((int(seams.start[edge]), int(seams.end[edge]))):
            pair = (int(seams.left[edge, side]), int(seams.right[edge, side]))
            low, high = min(pair), max(pair)
            crossed.update((vertex, z) for z in heights[vertex] if low <= z < high)
    return sorted({vertex for (vertex, _), count in crossed.items() if count > 2})


def _heights_at_ends(seams: Seams, steps: IntArray) -> dict[int, list[int]]:
    """Returns all heights at the ends of the given edges, ascending, by vertex."""
    vertices = np.concatenate([seams.start, seams.end, seams.start, seams.end])
    z = np.concatenate([seams.left.T.ravel(), seams.right.T.ravel()])
    wanted = np.unique(np.concatenate([seams.start[steps], seams.end[steps]]))
    keep = np.isin(vertices, wanted)
    pairs = np.unique(np.column_stack([vertices[keep], z[keep]]), axis=0)
    heights: dict[int, list[int]] = {}
    for vertex, height in pairs.tolist():
        heights.setdefault(vertex, []).append(height)
    return heights


def _wall(seams: Seams, edge: int, heights: dict[int, list[int]]) -> list[list[tuple[int, int]]]:
    """Triangulates between two vertical chains; the triangles face the lower side."""
    ends = [(int(seams.start[edge]), 0), (int(seams.end[edge]), 1)]
    left, right = seams.left[edge], seams.right[edge]
    if left.sum() < right.sum():
        ends.reverse()
        left, right = right, left
    near, far = (
        _chain(vertex, int(right[side]), int(left[side]), heights[vertex]) for vertex, side in ends
    )
    below = [[near[0], far[k], far[k + 1]] for k in range(len(far) - 1)]
    return below + [[near[k], far[-1], near[k + 1]] for k in range(len(near) - 1)]


def _chain(vertex: int, first: int, last: int, heights: list[int]) -> list[tuple[int, int]]:
    """Returns the vertices above each other between the heights of the two surfaces."""
    low, high = min(first, last), max(first, last)
    chain = [(vertex, z) for z in heights if low <= z <= high]
    return chain if first <= last else chain[::-1]
