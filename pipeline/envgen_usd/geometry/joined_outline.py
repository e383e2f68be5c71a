"""The outline of the road in a rectangle, from edges that were found piece by piece."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from envgen_usd.geometry.border_loops import trace_loops
from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray, IntArray


@dataclass(frozen=True)
class JoinedOutline:
    """Closed loops around the road in a rectangle.

    Attributes:
        vertices: V x 3, metres.
        loops: Indices of vertices, without repeated last index; the road lies to their left.
        gaps: G x 2, metres, places at which edges ended that no other edge met; straight edges
            close them.
    """

    vertices: FloatArray
    loops: tuple[IntArray, ...]
    gaps: FloatArray


def joined_outline(edges: FloatArray, bounds: Bounds) -> JoinedOutline:
    """Joins edges of an outline to loops; the border of the rectangle closes those that leave it.

    The result does not depend on the order of the edges.

    Args:
        edges: E x 2 x 3, metres, the road to the left of each; each edge of the outline in the
            rectangle once.
        bounds: The rectangle, metres.
    """
    inside = _cut(edges, bounds)
    corners = inside.reshape(-1, 3)
    _, first, number = np.unique(corners[:, :2], axis=0, return_index=True, return_inverse=True)
    vertices, directed = corners[first], number.reshape(-1, 2)
    directed = directed[directed[:, 0] != directed[:, 1]]
    directed = directed[np.lexsort(directed.T[::-1])]
    leave, arrive = (np.bincount(side, minlength=len(vertices)) for side in directed.T)
    every = np.arange(len(vertices))
    ends = np.repeat(every, np.maximum(arrive - leave, 0))
    starts = np.repeat(every, np.maximum(leave - arrive, 0))
    rim, ends, starts = _along_rim(vertices, ends, starts, bounds)
    straight = np.stack([ends, _nearest(vertices, ends, starts)], axis=1)
    gaps = vertices[np.append(ends, starts), :2]
    vertices = np.concatenate([vertices, rim.corners])
    joined = np.concatenate([directed, rim.edges, straight])
    return JoinedOutline(vertices, tuple(trace_loops(joined, vertices[:, :2])), gaps)


def _cut(edges: FloatArray, bounds: Bounds) -> FloatArray:
    """The parts of edges in a rectangle (Liang and Barsky 1984).

    An edge on the border stays if the road lies to its side of the rectangle.
    """
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    start, along = edges[:, 0, :2], edges[:, 1, :2] - edges[:, 0, :2]
    moves = along != 0.0
    step = np.where(moves, along, 1.0)
    one, other = (low - start) / step, (high - start) / step
    enters = np.where(moves, np.minimum(one, other), -np.inf).max(axis=1)
    leaves = np.where(moves, np.maximum(one, other), np.inf).min(axis=1)
    beside = (~moves & ((start < low) | (start > high))).any(axis=1)
    # Counter-clockwise along the border, the road on the left is inside.
    (west, south), (east, north) = (start == low).T, (start == high).T
    (level, upright), (right, up) = ~moves.T[::-1], (along > 0.0).T
    beside |= level & ((south & ~right) | (north & right))
    beside |= upright & ((west & up) | (east & ~up))
    first, last = np.maximum(enters, 0.0), np.minimum(leaves, 1.0)
    kept = ~beside & (first < last)
    result: FloatArray = edges[kept].copy()
    for side, share in ((0, first[kept]), (1, last[kept])):
        moved = (share > 0.0) & (share < 1.0)
        whole = edges[kept][moved]
        cut = whole[:, 0] + share[moved, None] * (whole[:, 1] - whole[:, 0])
        cut[:, :2] = _onto_border(cut[:, :2], low, high)
        result[moved, side] = cut
    return result


def _onto_border(points: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Points (N x 2) next to the border of a rectangle, exactly on it."""
    sides = np.concatenate([low, high])
    away = np.abs(points[:, [0, 1, 0, 1]] - sides)
    nearest = np.argmin(away, axis=1)
    moved = np.clip(points, low, high)
    moved[np.arange(len(points)), nearest % 2] = sides[nearest]
    return moved


@dataclass(frozen=True)
class _Rim:
    """Edges along the border of a rectangle, E x 2, and the corners on their way, C x 3."""

    edges: IntArray
    corners: FloatArray


def _along_rim(
    vertices: FloatArray, ends: IntArray, starts: IntArray, bounds: Bounds
) -> tuple[_Rim, IntArray, IntArray]:
    """Leads each end on the border counter-clockwise to the next start.

    Returns:
        The edges, and the ends and starts that are left.
    """
    place = _places_on_rim(vertices, bounds)
    on_rim = [~np.isnan(place[part]) for part in (ends, starts)]
    last, first = ends[on_rim[0]], starts[on_rim[1]]
    if len(last) != len(first) or not len(last):
        return _Rim(np.empty((0, 2), np.int64), np.empty((0, 3))), ends, starts
    last, first = (part[np.argsort(place[part], kind="stable")] for part in (last, first))
    first = np.roll(first, -int(np.searchsorted(place[first], place[last[0]])))
    x0, y0, x1, y1 = bounds
    around = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    turns = np.cumsum([0.0, x1 - x0, y1 - y0, x1 - x0, y1 - y0])
    marks = np.concatenate([turns[:-1], turns[:-1] + turns[-1]])
    corners, edges, count = [np.empty((0, 3))], [], len(vertices)
    for end, start in zip(last.tolist(), first.tolist(), strict=True):
        to = place[start] + (turns[-1] if place[start] < place[end] else 0.0)
        passed = np.flatnonzero((marks > place[end]) & (marks < to))
        heights = np.full(len(passed), vertices[end, 2])
        corners.append(np.column_stack([around[passed % 4], heights]))
        path = [end, *range(count, count + len(passed)), start]
        count += len(passed)
        edges += list(pairwise(path))
    rim = _Rim(np.array(edges, np.int64), np.concatenate(corners))
    return rim, ends[~on_rim[0]], starts[~on_rim[1]]


def _places_on_rim(vertices: FloatArray, bounds: Bounds) -> FloatArray:
    """Places of V vertices along the border from its south-western corner, counter-clockwise.

    Returns:
        V, metres; NaN for vertices that are not on it.
    """
    (x, y), (x0, y0, x1, y1) = vertices[:, :2].T, bounds
    wide, deep = x1 - x0, y1 - y0
    place = np.full(len(vertices), np.nan)
    for on_side, along in (
        (x == x0, 2 * wide + deep + y1 - y),
        (y == y1, wide + deep + x1 - x),
        (x == x1, wide + y - y0),
        (y == y0, x - x0),
    ):
        place[on_side] = along[on_side]
    return place


def _nearest(vertices: FloatArray, ends: IntArray, starts: IntArray) -> IntArray:
    """The start that is nearest to each end, each once."""
    free = np.ones(len(starts), np.bool_)
    chosen = np.empty(len(ends), np.int64)
    for number, end in enumerate(ends.tolist()):
        away = np.hypot(*(vertices[starts, :2] - vertices[end, :2]).T)
        nearest = int(np.argmin(np.where(free, away, np.inf)))
        chosen[number], free[nearest] = starts[nearest], False
    return chosen
