import numpy as np
import pytest
import shapely

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.geometry.square_index import SIDE
from envgen_usd.models.road_surface import RoadSurface

STAR = np.array([(0, 0), (40, 10), (90, 0), (60, 40), (90, 80), (40, 60), (0, 90), (20, 40)], float)
HOLE = np.array([(35, 30), (35, 45), (50, 45), (50, 30)], float)


@pytest.fixture(scope="module")
def outline() -> Outline:
    plan = np.concatenate([STAR, HOLE])
    vertices = np.column_stack([plan, plan[:, 0] * 0.1])
    none = np.empty(0, dtype=np.int64)
    loops = (np.arange(len(STAR)), np.arange(len(STAR), len(plan)))
    return Outline.of(RoadSurface(vertices, none.reshape(0, 3), none, none, (), loops, (), ()))


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return np.random.default_rng(0).uniform(-30.0, 120.0, (2000, 2))


def test_nearest_place_is_that_of_the_line(outline, points):
    line = shapely.union_all([shapely.LinearRing(STAR), shapely.LinearRing(HOLE)])
    distance, place = outline.nearest(points)
    assert np.allclose(distance, shapely.distance(line, shapely.points(points)), atol=1e-9)
    assert np.allclose(shapely.distance(line, shapely.points(place[:, :2])), 0.0, atol=1e-9)
    assert np.allclose(place[:, 2], 0.1 * place[:, 0])


def test_a_long_edge_is_nearer_than_many_short_ones_beside_it():
    arc = np.linspace(np.pi, 0.0, 60)[1:-1]
    bay = np.stack([0.1 * np.cos(arc), 0.15 + 0.1 * np.sin(arc)], axis=1)
    plan = np.concatenate([[(-9.3, 0.0), (9.4, 0.0), (9.4, 0.12), (0.1, 0.12)], bay[::-1]])
    vertices = np.column_stack([plan, np.arange(len(plan), dtype=float)])
    none = np.empty(0, dtype=np.int64)
    loops = (np.arange(len(plan)),)
    made = Outline.of(RoadSurface(vertices, none.reshape(0, 3), none, none, (), loops, (), ()))
    places, _ = made.samples(0.013)
    distance, found = made.nearest(places)
    assert np.max(distance) < 1e-9
    assert np.allclose(found[:, :2], places[:, :2])


def test_nothing_is_found_beyond_reach(outline, points):
    far, _ = outline.nearest(points)
    near, _ = outline.nearest(points, 5.0)
    assert np.array_equal(near[far <= 5.0], far[far <= 5.0])
    assert np.all(np.isinf(near[far > 5.0]))


def test_encloses_leaves_out_holes(outline, points):
    polygon = shapely.Polygon(STAR, [HOLE])
    assert np.array_equal(outline.encloses(points), shapely.contains_xy(polygon, points))
    assert outline.encloses(np.empty((0, 2))).shape == (0,)


def test_a_grid_is_enclosed_like_its_points(outline):
    x, y = np.linspace(-20.1, 110.3, 61), np.linspace(-20.7, 110.9, 47)
    on_road = shapely.contains_xy(shapely.Polygon(STAR, [HOLE]), *np.meshgrid(x, y))
    assert np.array_equal(outline.encloses_grid(x, y), on_road)


@pytest.mark.parametrize("seed", range(12))
def test_places_on_a_large_map_are_enclosed_by_the_edges_near_them(seed):
    """As by all edges; loops cross, and vertices and places lie on the lines of the index."""
    draw = np.random.default_rng(seed)
    step = SIDE if seed % 2 else 1e-3
    rings = [
        np.round(draw.uniform(-400.0, 400.0, (draw.integers(3, 40), 2)) / step) * step
        for _ in range(draw.integers(1, 6))
    ]
    vertices = np.concatenate([np.column_stack([ring, np.zeros(len(ring))]) for ring in rings])
    ends = np.cumsum([len(ring) for ring in rings])
    loops = tuple(np.split(np.arange(len(vertices)), ends[:-1]))
    none = np.empty(0, dtype=np.int64)
    made = Outline.of(RoadSurface(vertices, none.reshape(0, 3), none, none, (), loops, (), ()))
    start, end = made.start[:, :2], made.end[:, :2]
    for corner in draw.uniform(-450.0, 400.0, (5, 2)):
        x, y = (np.round(at / 25) * 25 + np.arange(9) * 12.5 for at in corner)
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        crosses = (start[:, 1] <= places[:, 1:]) != (end[:, 1] <= places[:, 1:])
        rise = np.where(crosses, end[:, 1] - start[:, 1], 1.0)
        share = (places[:, 1:] - start[:, 1]) / rise
        beyond = start[:, 0] + share * (end - start)[:, 0] > places[:, :1]
        expected = (crosses & beyond).sum(axis=1) % 2 == 1
        assert np.array_equal(made.encloses(places), expected)
        assert np.array_equal(made.encloses_grid(x, y).ravel(), expected)


def test_samples_are_dense_and_hold_all_corners(outline):
    samples, edge = outline.samples(0.7)
    steps = np.linalg.norm(np.diff(samples[:, :2], axis=0), axis=1)
    assert np.max(steps[np.diff(edge) == 0]) <= 0.7 + 1e-9
    assert {tuple(p) for p in np.concatenate([STAR, HOLE])} <= {tuple(p) for p in samples[:, :2]}


def test_near_keeps_what_touches_a_rectangle(outline):
    assert len(outline.near((36.0, 31.0, 37.0, 32.0), 0.0)) == 0
    assert len(outline.near((36.0, 31.0, 37.0, 32.0), 2.0)) == 2
    assert len(outline.near((-np.inf, -np.inf, np.inf, np.inf), 0.0)) == len(outline)


def test_no_road_is_infinitely_far(points):
    empty = Outline(np.empty((0, 3)), np.empty((0, 3)))
    assert np.all(np.isinf(empty.nearest(points)[0]))
    assert not empty.encloses(points).any()
