"""Traces the border of joined faces as closed loops of vertices."""

from collections.abc import Iterable

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray


def border_loops(edges: Iterable[tuple[int, int]]) -> list[tuple[int, ...]] | None:
    """Joins directed edges without an opposite edge into loops, by topology alone.

    Args:
        edges: Start and end of all edges of the faces, each in the orientation of its face.

    Returns:
        Vertices of each loop in the orientation of the faces, from the smallest, without repeated
        last vertex. `None` where loops touch at a vertex; `trace_loops` resolves such vertices.
    """
    directed = set(edges)
    border = [(start, end) for start, end in directed if (end, start) not in directed]
    following = dict(border)
    if len(following) != len(border):
        return None
    loops = []
    while following:
        start = min(following)
        loop = [start]
        while (vertex := following.pop(loop[-1])) != start:
            loop.append(vertex)
        loops.append(tuple(loop))
    return loops


def trace_loops(edges: IntArray, points: FloatArray) -> list[IntArray]:
    """Joins directed border edges, with the surface on their left, into simple loops.

    1. At a vertex of several loops, a loop follows the wedge of the surface.
    2. A loop is split at each vertex that it revisits.

    Args:
        edges: E x 2, indices into `points`.
        points: P x 2, metres.

    Returns:
        Loops of indices without repeated last index; outer loops counter-clockwise, holes
        clockwise.
    """
    leaving: dict[int, list[int]] = {}
    for index, start in enumerate(edges[:, 0].tolist()):
        leaving.setdefault(start, []).append(index)
    direction = points[edges[:, 1]] - points[edges[:, 0]]
    angle = np.arctan2(direction[:, 1], direction[:, 0])
    ends = edges.tolist()
    unused = set(range(len(ends)))
    loops: list[IntArray] = []
    while unused:
        first = min(unused)
        loop = [first]
        unused.discard(first)
        while ends[loop[-1]][1] != ends[first][0] or len(leaving[ends[first][0]]) > 1:
            choices = [k for k in leaving[ends[loop[-1]][1]] if k in unused or k == first]
            following = _sharpest(angle, loop[-1], choices)
            if following == first:
                break
            loop.append(following)
            unused.discard(following)
        loops.extend(_split([ends[k][0] for k in loop]))
    return loops


def _sharpest(angle: FloatArray, arriving: int, choices: list[int]) -> int:
    """Returns the leaving edge that is next clockwise from the reversed arriving edge."""
    if len(choices) == 1:
        return choices[0]
    back = angle[arriving] + np.pi
    return min(choices, key=lambda k: float((back - angle[k]) % (2 * np.pi)))


def _split(loop: list[int]) -> list[IntArray]:
    """Splits a loop at revisited vertices."""
    loops: list[IntArray] = []
    path: list[int] = []
    place: dict[int, int] = {}
    for vertex in loop:
        if vertex in place:
            begin = place[vertex]
            loops.append(np.array(path[begin:], dtype=np.int64))
            for gone in path[begin:]:
                del place[gone]
            del path[begin:]
        place[vertex] = len(path)
        path.append(vertex)
    loops.append(np.array(path, dtype=np.int64))
    return [part for part in loops if len(part) > 2]
