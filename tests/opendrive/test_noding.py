"""Segments cut one another on the grid, also over the borders between chunks."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from envgen_usd.opendrive.mesh.noding import noded

BORDER = 200_000
"""Grid steps of a chunk."""
near = st.tuples(st.integers(-30, 30), st.integers(-12, 12))
segments = st.lists(st.tuples(near, near).filter(lambda two: two[0] != two[1]), min_size=1)


def cut(pairs, at=(BORDER, 0)):
    return noded(np.array(pairs, dtype=np.int64) + np.array(at))


@settings(max_examples=150, deadline=None)
@given(segments)
def test_edges_meet_at_their_ends_only(pairs):
    edges = cut(pairs)
    assert len(np.unique(np.sort(edges.reshape(-1, 4), axis=1), axis=0)) == len(edges)
    lines = shapely.linestrings(edges)
    one, other = shapely.STRtree(lines).query(lines, predicate="intersects")
    apart = one < other
    shared = shapely.intersection(lines[one[apart]], lines[other[apart]])
    assert (shapely.get_type_id(shared) == shapely.GeometryType.POINT).all()
    ends = {tuple(end) for end in edges.reshape(-1, 2).tolist()}
    assert {tuple(map(round, point.coords[0])) for point in shared} <= ends
    assert all(max(abs(v - round(v)) for v in point.coords[0]) < 1e-6 for point in shared)


@settings(max_examples=100, deadline=None)
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


def test_long_segments_are_split_at_every_border():
    edges = noded(np.array([[[-500_000, 0], [500_000, 100]]]))
    assert sorted(edges[:, :, 0].ravel().tolist()) == sorted(
        [-500_000, *2 * [-400_000, -200_000, 0, 200_000, 400_000], 500_000]
    )
