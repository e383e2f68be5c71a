"""Faces of planar graphs against those of GEOS."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from envgen_usd.opendrive.mesh.face_tracing import trace_faces
from envgen_usd.opendrive.mesh.noding import noded

place = st.tuples(st.integers(0, 14), st.integers(0, 14))
segments = st.lists(
    st.tuples(place, place).filter(lambda two: two[0] != two[1]), min_size=1, max_size=30
)


def faces(points, edges):
    rings = trace_faces(points, edges)
    owner = np.repeat(np.arange(len(rings.face)), np.diff(rings.start))
    corners = points[rings.vertices].astype(float)
    return shapely.polygons(shapely.linearrings(corners, indices=owner), indices=rings.face)


@settings(max_examples=300)
@given(segments)
def test_the_faces_are_those_of_polygonize(pairs):
    points, edges = noded(np.array(pairs))
    found = faces(points, edges)
    expected = shapely.get_parts(shapely.polygonize(shapely.linestrings(points[edges])))
    assert shapely.is_valid(found).all()
    assert sorted(part.normalize().wkt for part in found) == sorted(
        part.normalize().wkt for part in expected
    )


def ring(low, high):
    corners = [(low, low), (high, low), (high, high), (low, high)]
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


def test_rings_in_rings_are_holes_and_faces():
    points, edges = noded(np.array([*ring(0, 100), *ring(20, 80), *ring(40, 60)]))
    assert sorted(shapely.area(faces(points, edges)).tolist()) == [400, 3600 - 400, 10000 - 3600]


def test_lines_that_bound_nothing_are_left_out():
    points, edges = noded(np.array([*ring(0, 100), ((100, 100), (150, 150)), ((20, 20), (30, 30))]))
    (face,) = faces(points, edges)
    assert shapely.get_num_interior_rings(face) == 0
    assert face.area == 10000
