"""Segments cut one another on the grid, also over the borders between chunks."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from envgen_usd.opendrive.mesh.noding import noded

BORDER = 200_000
"""Grid steps of a chunk."""
near = st.tuples(st.integers(-30, 30), st.integers(-12, 12))
segments = st.lists(st.tuples(near, near).filter(lambda two: two[0] != two[1]), min_size=1)


def cut(pairs, at=(BORDER, 0), apart=1):
    points, edges = noded(np.array(pairs, dtype=np.int64) + np.array(at), apart)
    return points[edges]


@pytest.mark.parametrize("apart", [1, 5])
@settings(max_examples=150)
@given(segments)
def test_edges_meet_at_their_ends_only(apart, pairs):
    edges = cut(pairs, apart=apart)
    assert len(np.unique(np.sort(edges.reshape(-1, 4), axis=1), axis=0)) == len(edges)
    lines = shapely.linestrings(edges)
    one, other = shapely.STRtree(lines).query(lines, predicate="intersects")
    apart = one < other
    shared = shapely.intersection(lines[one[apart]], lines[other[apart]])
    assert (shapely.get_type_id(shared) == shapely.GeometryType.POINT).all()
    ends = {tuple(end) for end in edges.reshape(-1, 2).tolist()}
    assert {tuple(map(round, point.coords[0])) for point in shared} <= ends
    assert all(max(abs(v - round(v)) for v in point.coords[0]) < 1e-6 for point in shared)


@settings(max_examples=100)
@given(segments)
def test_edges_stay_where_the_segments_were(pairs):
    """Rounding moves what is cut by less than the diagonal of a grid cell."""
    edges = cut(pairs)
    before = shapely.multilinestrings(np.array(pairs, dtype=float) + np.array([BORDER, 0]))
    after = shapely.multilinestrings(edges.astype(float))
    assert shapely.hausdorff_distance(before, after) < 1.5


def test_what_lies_on_a_border_is_cut_by_both_sides():
    along = ((0, -10), (0, 10))
    edges = cut([along, ((-20, 3), (0, 3)), ((0, -4), (20, -4)), ((-20, 0), (20, 0))])
    on_border = edges[(edges[:, :, 0] == BORDER).all(axis=1)][:, :, 1]
    assert sorted(map(sorted, on_border.tolist())) == [[-10, -4], [-4, 0], [0, 3], [3, 10]]
    assert len(edges) == 4 + 4


@settings(max_examples=150)
@given(segments)
def test_vertices_keep_their_distance(pairs):
    """No edge is shorter than the distance, and none passes a vertex nearer than half of it."""
    edges = cut(pairs, apart=5)
    vertices = np.unique(edges.reshape(-1, 2), axis=0)
    distance = np.abs(vertices[:, None] - vertices).max(axis=2)
    np.fill_diagonal(distance, 5)
    assert (distance >= 5).all() if len(vertices) else True
    lines, points = shapely.linestrings(edges), shapely.points(vertices)
    point, line = shapely.STRtree(lines).query(points, predicate="dwithin", distance=2.4)
    assert (vertices[point][:, None] == edges[line]).all(axis=2).any(axis=1).all()


@settings(max_examples=100)
@given(segments)
def test_what_is_near_a_chunk_border_moves_onto_it(pairs):
    edges = cut(pairs, apart=5)
    aside = np.abs(edges[:, :, 0] - BORDER)
    assert ((aside == 0) | (aside >= 5)).all()


def test_anchors_stay():
    pairs = [((100, 100), (103, 98)), ((103, 98), (900, 700))]
    for anchor in pairs[0]:
        points, edges = noded(np.array(pairs), 5, np.array([anchor]))
        assert points.tolist() == [list(anchor), [900, 700]]
        assert edges.tolist() == [[0, 1]]
