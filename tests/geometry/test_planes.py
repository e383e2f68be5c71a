import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from envgen_usd.geometry.polygon_planes import (
    flat_coordinates,
    polygon_normals,
    ring_areas,
)
from envgen_usd.models.polygon_arrays import Polygons

SQUARE = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], dtype=float)
HOLE = np.array([[1, 1, 0], [1, 2, 0], [3, 2, 0], [3, 1, 0]], dtype=float)
WITH_HOLE = Polygons(np.concatenate([SQUARE, HOLE]), np.array([0, 4, 8]), np.array([0, 2]))

angles = st.floats(-3, 3)


def turned(polygons, *by, shift=0.0):
    points = Rotation.from_euler("xyz", by).apply(polygons.points.copy()) + shift
    return Polygons(points, polygons.ring_offsets, polygons.polygon_offsets)


@given(angles, angles, angles, st.floats(-1e6, 1e6))
def test_area_and_normal_turn_with_the_polygon(a, b, c, shift):
    found = turned(WITH_HOLE, a, b, c, shift=shift)

    expected = Rotation.from_euler("xyz", [a, b, c]).apply([0, 0, 1])
    np.testing.assert_allclose(polygon_normals(found)[0], expected, atol=1e-6)
    area = np.linalg.norm(ring_areas(found.points, found.ring_offsets).sum(axis=0))
    assert area == pytest.approx(16 - 2, abs=1e-6)


def test_a_hole_turns_the_other_way():
    exterior, hole = ring_areas(WITH_HOLE.points, WITH_HOLE.ring_offsets)

    assert exterior.tolist() == [0, 0, 16]
    assert hole.tolist() == [0, 0, -2]


def test_area_of_a_concave_ring():
    ring = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0.5, 0], [0, 2, 0]])

    assert ring_areas(ring, np.array([0, 5])).tolist() == [[0, 0, pytest.approx(4 - 1.5)]]


@given(angles, angles, angles)
def test_flat_coordinates_run_counter_clockwise(a, b, c):
    u, v = flat_coordinates(turned(WITH_HOLE, a, b, c))[:4].T

    assert (u * np.roll(v, -1) - v * np.roll(u, -1)).sum() > 0


def test_a_polygon_without_area_has_no_normal():
    line = Polygons.of_rings([np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], dtype=float)])

    assert polygon_normals(line).tolist() == [[0, 0, 0]]


def test_nothing_gives_nothing():
    nothing = Polygons.of_rings([])

    assert polygon_normals(nothing).shape == (0, 3)
    assert ring_areas(nothing.points, nothing.ring_offsets).shape == (0, 3)
    assert flat_coordinates(nothing).shape == (0, 2)
