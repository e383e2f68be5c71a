from itertools import pairwise

import numpy as np
import pytest

from envgen_usd.assets.polygon_mesh import face_normals, merge, vertex_normals
from envgen_usd.assets.shapes.broadleaf_trees import BROADLEAF_SPECIES
from envgen_usd.assets.shapes.conifers import CONES, CONIFER_SPECIES, whorled_tree
from envgen_usd.assets.shapes.crowned_trees import crowned_tree
from envgen_usd.assets.shapes.simple_solids import box, lathe, moved, post, raised, tube
from envgen_usd.assets.shapes.tree_skeletons import Growth, branches, grown


def triangles(mesh):
    starts = np.concatenate([[0], np.cumsum(mesh.face_sizes)[:-1]])
    for start, size in zip(starts, mesh.face_sizes, strict=True):
        corner = mesh.points[mesh.face_vertices[start : start + size]]
        for k in range(1, size - 1):
            yield corner[[0, k, k + 1]]


def volume(mesh):
    """Signed volume by the divergence theorem: right only if all faces look outwards."""
    return sum(np.linalg.det(t) for t in triangles(mesh)) / 6


def test_box_is_closed_and_looks_outwards():
    assert volume(box((1, 2, 3), (2, 4, 6))) == pytest.approx(6.0)


def test_tube_and_post_have_the_volume_of_prisms():
    area = 0.5 * 12 * 0.1**2 * np.sin(2 * np.pi / 12)
    assert volume(post(3.0, 0.1, 12)) == pytest.approx(3.0 * area)
    path = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    assert volume(tube(path, np.full(3, 0.1), 12)) == pytest.approx(2.0 * area)


def test_lathe_has_the_volume_of_a_frustum():
    sides = 64
    cone = lathe(np.array([[1.0, 0.0], [0.5, 2.0]]), sides)
    ratio = 0.5 * sides * np.sin(2 * np.pi / sides) / np.pi
    expected = np.pi * 2.0 / 3 * (1 + 0.5 + 0.25) * ratio
    assert volume(cone) == pytest.approx(expected, rel=1e-6)


def test_merge_adds_volumes():
    assert volume(
        merge([box((0, 0, 0), (1, 1, 1)), moved(box((0, 0, 0), (1, 1, 1)), (5, 0, 0))])
    ) == (pytest.approx(2.0))


def test_newell_gives_twice_the_area():
    points = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    np.testing.assert_allclose(face_normals(points, np.array([4]), np.arange(4)), [[0, 0, 4.0]])


def test_vertex_normals_of_a_roof_ridge_point_up():
    points = np.array([[0.0, -1, 0], [1, -1, 0], [1, 0, 1], [0, 0, 1], [1, 1, 0], [0, 1, 0]])
    faces = np.array([0, 1, 2, 3, 3, 2, 4, 5])
    normals = vertex_normals(points, np.array([4, 4]), faces)
    np.testing.assert_allclose(normals[2], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("make", [
    *(lambda rng, c=c: crowned_tree(c, "leaves", rng) for c in BROADLEAF_SPECIES.values()),
    *(lambda rng, c=c: crowned_tree(c, "needles", rng) for c in CONIFER_SPECIES.values()),
    *(lambda rng, c=c: whorled_tree(c, "needles", rng) for c in CONES.values()),
])  # fmt: skip
def test_leaves_are_lit_from_the_side_on_which_they_are_seen(make):
    """The shading normal and the face agree, so that drawing both sides flips neither wrongly."""
    leaves = make(np.random.default_rng(0)).parts[1].mesh
    faces = face_normals(leaves.points, leaves.face_sizes, leaves.face_vertices)
    shading = leaves.normals.reshape(len(faces), 4, 3).mean(axis=1)
    assert ((faces * shading).sum(axis=1) > 0).mean() > 0.97
    np.testing.assert_allclose(np.linalg.norm(leaves.normals, axis=1), 1.0, atol=1e-9)


@pytest.fixture
def skeleton():
    """A tree that grows into a ball of free space above its stem."""
    rng = np.random.default_rng(3)
    space = rng.normal(size=(400, 3))
    space *= 2.5 * rng.random((400, 1)) ** (1 / 3) / np.linalg.norm(space, axis=1, keepdims=True)
    stem = np.stack([np.zeros(8), np.zeros(8), np.linspace(0, 3, 8)], axis=1)
    space[:, 2] += 5.0
    return space, grown(stem, space, Growth(), rng)


def test_branches_fill_the_free_space_and_nothing_else(skeleton):
    space, tree = skeleton
    gaps = np.linalg.norm(space[:, None] - tree.points, axis=2).min(axis=1)
    assert gaps.max() < 1.0
    assert np.linalg.norm(tree.points[8:] - [0, 0, 5], axis=1).max() < 3.2


def test_cross_sections_add_up_at_forks(skeleton):
    """Leonardo's rule, with the exponent 2.1 of measured trees."""
    _, tree = skeleton
    carried = np.bincount(tree.parents[1:], tree.radii[1:] ** 2.1, len(tree.points))
    forks = ~tree.tips()
    np.testing.assert_allclose(tree.radii[forks] ** 2.1, carried[forks], rtol=1e-9)
    assert np.allclose(tree.radii[tree.tips()], tree.radii.min())


def test_every_segment_is_in_one_branch(skeleton):
    _, tree = skeleton
    pairs = {pair for line in branches(tree) for pair in pairwise(line.tolist())}
    assert pairs == set(zip(tree.parents[1:].tolist(), range(1, len(tree.points)), strict=True))


def test_turned_walls_are_round_and_their_edges_sharp():
    # A drum of radius 2 below a cone whose sides rise by 1 for each metre to the middle.
    drum = lathe(np.array([[2.0, 0.0], [2.0, 3.0], [0.0, 5.0]]), 12)
    places, normals = drum.points[drum.face_vertices], drum.normals
    away = places * [1.0, 1.0, 0.0] / np.hypot(places[:, 0], places[:, 1])[:, None]
    wall = np.abs(normals[:, 2]) < 1e-9
    assert wall.sum() == 4 * 12
    np.testing.assert_allclose(normals[wall], away[wall], atol=1e-9)
    cone = np.abs(normals[:, 2] - np.cos(np.pi / 4)) < 0.02
    assert cone.sum() == 4 * 12
    lower = cone & (places[:, 2] < 4.0)
    outward = (normals[lower] * away[lower]).sum(axis=1)
    np.testing.assert_allclose(outward, np.sqrt(0.5), atol=0.02)
    assert (normals[:, 2] < -0.99).sum() == 12  # the foot


def test_a_curve_of_the_outline_has_the_normals_of_its_sphere():
    angle = np.linspace(-1.2, 1.2, 13)
    ball = lathe(np.stack([np.cos(angle), np.sin(angle)], axis=1), 24)
    places, normals = ball.points[ball.face_vertices], ball.normals
    inside = np.abs(places[:, 2]) < 0.9
    apart = np.arccos(np.clip((places * normals).sum(axis=1)[inside], -1.0, 1.0))
    assert np.degrees(apart).max() < 3.0


def test_a_raised_field_slopes_to_its_face():
    field = raised((0.0, 0.03, 0.0), (1.0, 0.05, 2.0), (0.1, 0.2))
    face = field.points[field.points[:, 1] > 0.04]
    np.testing.assert_allclose(face.min(axis=0), [0.1, 0.05, 0.2])
    np.testing.assert_allclose(face.max(axis=0), [0.9, 0.05, 1.8])
    assert (field.normals[:, 1] > 0.0).all(), "nothing looks into the door"
    middle = field.points.mean(axis=0)
    outwards = ((field.points[field.face_vertices] - middle) * field.normals).sum(axis=1)
    assert (outwards > 0.0).all()
