"""Loops from border edges."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from envgen_usd.geometry.border_loops import border_loops, trace_loops


def border_of(cells):
    """Border edges of unit squares, with the squares on their left, and the grid's points."""
    side = 12
    edges = set()
    for x, y in cells:
        ring = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
            edge = (a[1] * side + a[0], b[1] * side + b[0])
            if edge[::-1] in edges:
                edges.remove(edge[::-1])
            else:
                edges.add(edge)
    points = np.array([(k % side, k // side) for k in range(side * side)], dtype=float)
    return np.array(sorted(edges), dtype=np.int64), points


def signed_area(ring):
    following = np.roll(ring, -1, axis=0)
    return float((ring[:, 0] * following[:, 1] - ring[:, 1] * following[:, 0]).sum() / 2)


@given(st.sets(st.tuples(st.integers(0, 10), st.integers(0, 10)), min_size=1, max_size=80))
def test_loops_use_every_edge_once_and_enclose_the_cells(cells):
    edges, points = border_of(cells)
    loops = trace_loops(edges, points)
    used = [
        (a, b)
        for loop in loops
        for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
    ]
    assert sorted(used) == sorted(map(tuple, edges.tolist()))
    assert all(len(set(loop.tolist())) == len(loop) for loop in loops)
    assert sum(signed_area(points[loop]) for loop in loops) == len(cells)


@given(st.sets(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=30))
def test_vertices_alone_give_the_same_loops_where_no_two_touch(cells):
    edges, points = border_of(cells)
    side = 12
    squares = [(y * side + x, y * side + x + 1, (y + 1) * side + x + 1) for x, y in cells]
    squares = [(a, b, c, c - 1) for a, b, c in squares]
    loops = border_loops((square[i], square[(i + 1) % 4]) for square in squares for i in range(4))
    if len(set(edges[:, 0].tolist())) < len(edges):
        assert loops is None
        return
    assert all(loop[0] == min(loop) for loop in loops)
    turned = [np.roll(loop, -int(np.argmin(loop))) for loop in trace_loops(edges, points)]
    assert sorted(loops) == sorted(tuple(loop.tolist()) for loop in turned)


def test_squares_that_touch_at_a_corner_are_two_loops():
    edges, points = border_of({(0, 0), (1, 1)})
    assert sorted(len(loop) for loop in trace_loops(edges, points)) == [4, 4]


def test_a_hole_runs_clockwise():
    edges, points = border_of({(x, y) for x in range(3) for y in range(3)} - {(1, 1)})
    areas = sorted(signed_area(points[loop]) for loop in trace_loops(edges, points))
    assert areas == [-1, 9]
