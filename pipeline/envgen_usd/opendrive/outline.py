"""Border of a set of faces as simple closed loops."""

import numpy as np

from envgen_usd.models.arrays import FloatArray, IntArray


def trace_loops(edges: IntArray, points: FloatArray) -> list[IntArray]:
    """Joins directed border edges, with the surface on their left, into simple loops.

    1. At a vertex that several loops touch, the loop follows the wedge of the surface.
    2. A loop that comes back to one of its vertices is split there.

    Args:
        edges: E x 2, indices into points.
        points: P x 2.

    Returns:
        Loops of indices, not repeated at the end; outer loops counter-clockwise, holes clockwise.
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
    """The leaving edge that comes first clockwise from the arriving one, seen back."""
    if len(choices) == 1:
        return choices[0]
    back = angle[arriving] + np.pi
    return min(choices, key=lambda k: float((back - angle[k]) % (2 * np.pi)))


def _split(loop: list[int]) -> list[IntArray]:
    """Splits a loop at vertices that it visits more than once."""
    found: list[IntArray] = []
    path: list[int] = []
    place: dict[int, int] = {}
    for vertex in loop:
        if vertex in place:
            begin = place[vertex]
            found.append(np.array(path[begin:], dtype=np.int64))
            for gone in path[begin:]:
                del place[gone]
            del path[begin:]
        place[vertex] = len(path)
        path.append(vertex)
    found.append(np.array(path, dtype=np.int64))
    return [part for part in found if len(part) > 2]
