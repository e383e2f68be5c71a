from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from envgen_usd.geometry.polygon_planes import polygon_normals, ring_areas
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.polygon_arrays import Polygons


def star(generator, corners, radius):
    """A simple ring about the origin, most often concave."""
    angle = (np.arange(corners) + generator.uniform(-0.3, 0.3, corners)) * 2 * np.pi / corners
    distance = generator.uniform(0.5, 1.0, corners) * radius
    return np.column_stack([np.cos(angle) * distance, np.sin(angle) * distance, angle * 0])


def edges(ring_points):
    return {tuple(sorted(pair)) for pair in zip(ring_points, np.roll(ring_points, -1), strict=True)}


def areas_and_normals(polygons, triangles):
    a, b, c = (polygons.points[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    return np.linalg.norm(cross, axis=1) / 2, cross


@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(st.integers(3, 12), st.booleans()), min_size=1, max_size=5),
)
def test_triangles_cover_each_polygon_and_keep_its_edges(seed, sizes):
    generator = np.random.default_rng(seed)
    points, ring_offsets, polygon_offsets = [], [0], [0]
    for corners, has_hole in sizes:
        rings = [star(generator, corners, 10)]
        if has_hole and corners > 4:
            rings.append(star(generator, 4, 1.2)[::-1])
        turn = Rotation.random(random_state=generator)
        for ring in rings:
            points.append(turn.apply(ring) + 1e4)
            ring_offsets.append(ring_offsets[-1] + len(ring))
        polygon_offsets.append(len(ring_offsets) - 1)
    polygons = Polygons(np.concatenate(points), np.array(ring_offsets), np.array(polygon_offsets))

    triangles, owner = triangulate(polygons)

    area, cross = areas_and_normals(polygons, triangles)
    covered = np.bincount(owner, weights=area, minlength=len(polygons))
    rings = ring_areas(polygons.points, polygons.ring_offsets)
    # Holes run the other way around.
    areas = np.linalg.norm(np.add.reduceat(rings, polygons.polygon_offsets[:-1]), axis=1)
    np.testing.assert_allclose(covered, areas, rtol=1e-6)
    assert (np.einsum("ij,ij->i", cross, polygon_normals(polygons)[owner]) > 0).all()
    made = {edge for triangle in triangles for edge in edges(triangle)}
    rings = [np.arange(a, b) for a, b in pairwise(ring_offsets)]
    assert all(edges(ring) <= made for ring in rings)


def test_a_vertex_on_a_straight_edge_stays_a_corner():
    ring = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 1], [0, 0, 1]], dtype=float)

    triangles, _ = triangulate(Polygons.of_rings([ring]))

    assert len(triangles) == 3
    assert set(triangles.ravel().tolist()) == {0, 1, 2, 3, 4}
    assert areas_and_normals(Polygons.of_rings([ring]), triangles)[0].min() > 0


@pytest.mark.parametrize("start", range(4))
def test_a_square_with_a_vertex_on_an_edge_is_cut_without_slivers(start):
    ring = np.roll([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 2, 0]], start, axis=0).astype(float)

    triangles, _ = triangulate(Polygons.of_rings([ring]))

    area, _ = areas_and_normals(Polygons.of_rings([ring]), triangles)
    assert area.sum() == pytest.approx(2)
    assert area.min() > 0.5


@pytest.mark.parametrize("start", range(4))
def test_an_arrow_head_is_cut_inside(start):
    ring = np.roll([[0, 0, 0], [2, 1, 0], [0, 2, 0], [0.5, 1, 0]], start, axis=0).astype(float)

    triangles, _ = triangulate(Polygons.of_rings([ring]))

    area, cross = areas_and_normals(Polygons.of_rings([ring]), triangles)
    assert area.sum() == pytest.approx(2 - 0.5)
    assert (cross[:, 2] > 0).all()


def test_a_ring_that_crosses_itself_becomes_a_fan_and_spoils_no_other():
    bow = np.array([[0, 0, 0], [2, 2, 0], [2, 0, 0], [1, -1, 0], [0, 2, 0]], dtype=float)
    house = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 3, 0], [0, 2, 0]], dtype=float)

    triangles, owner = triangulate(Polygons.of_rings([house, bow, house]))

    assert np.bincount(owner).tolist() == [3, 3, 3]
    assert triangles[owner == 1][:, 0].tolist() == [5, 5, 5]


def test_triangles_pass_through_unchanged():
    vertices = np.random.default_rng(1).normal(size=(9, 3))
    faces = np.array([[0, 1, 2], [3, 4, 5], [8, 7, 6]])

    triangles, owner = triangulate(Polygons.of_triangles(vertices, faces))

    assert triangles.tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    assert owner.tolist() == [0, 1, 2]


def test_nothing_gives_nothing():
    triangles, owner = triangulate(Polygons.of_rings([]))

    assert triangles.shape == (0, 3)
    assert owner.shape == (0,)
