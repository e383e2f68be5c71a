from dataclasses import replace

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE, Chunk, chunks_of_points
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.terrain.heightmaps import build_heightmaps
from envgen_usd.terrain.terrain_field import fit_terrain

FLAT = TerrainRules(0.0, 100.0, 0.5)
HILLS = TerrainRules(6.0, 120.0, 0.5)


def wavy(x, y):
    return 5.0 * np.sin(x / 60.0) + 3.0 * np.cos(y / 45.0)


def level(x, y):
    return np.full_like(x + y, 31.5)


def uphill(x, y):
    return 0.06 * x + 0.0 * y


def fall(x, y):
    return 0.05 * (y - 53.5) + 0.0 * x


def grid(chunk: Chunk) -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid(*chunk.corner_axes())


@pytest.mark.parametrize("name", ["curved", "cross", "ring"])
def test_a_road_on_an_inclined_plane_gives_that_plane(make_surface, areas, name):
    surface = make_surface(areas[name], lambda x, y: 12.0 + 0.05 * x - 0.03 * y)
    for chunk, made in build_heightmaps(surface, [Chunk(0, 0), Chunk(1, -1)], FLAT, 0).items():
        x, y = grid(chunk)
        assert np.allclose(made.heights, 12.0 + 0.05 * x - 0.03 * y, atol=2e-3)


def test_a_straight_road_uphill_gives_a_slope_along_it(make_surface):
    surface = make_surface(shapely.box(-300.0, 50.0, 500.0, 57.0), uphill)
    x, _ = grid(Chunk(0, 0))
    made = build_heightmaps(surface, [Chunk(0, 0)], FLAT, 0)[Chunk(0, 0)]
    assert np.allclose(made.heights, 0.06 * x, atol=2e-3)


def test_cross_fall_of_a_single_road_does_not_tilt_the_land(make_surface):
    surface = make_surface(shapely.box(-300.0, 50.0, 500.0, 57.0), fall)
    made = build_heightmaps(surface, [Chunk(0, 0)], FLAT, 0)[Chunk(0, 0)]
    assert np.max(np.abs(made.heights)) <= 0.05 * 3.5 + 2e-3


@pytest.mark.parametrize("name", ["straight", "curved", "cross", "ring"])
def test_the_ground_meets_the_road_exactly(make_surface, areas, name):
    surface = make_surface(areas[name], wavy)
    field = fit_terrain(surface, HILLS, 3)
    samples, _ = field.outline.samples(0.3)
    assert np.allclose(field(samples[:, :2]), samples[:, 2], atol=1e-6)


@pytest.mark.parametrize("name", ["straight", "curved", "cross", "ring"])
@pytest.mark.parametrize("relief", [0.0, 9.0])
def test_banks_are_not_steeper_than_the_rule(make_surface, areas, name, relief):
    surface = make_surface(areas[name], lambda x, y: np.where(x + 0 * y > 60.0, 0.15 * (x - 60), 0))
    rules = TerrainRules(relief, 100.0, 0.4)
    chunks = chunks_of_points(shapely.get_coordinates(areas[name]), 100.0)
    for made in build_heightmaps(surface, chunks, rules, 0).values():
        east = np.diff(made.heights, axis=1)[:-1] / CELL_SIZE
        north = np.diff(made.heights, axis=0)[:, :-1] / CELL_SIZE
        assert np.max(np.hypot(east, north)) <= 0.4 + 0.01


def test_neighbours_share_their_border_and_nothing_depends_on_the_other_chunks(make_surface, areas):
    surface = make_surface(areas["cross"], wavy)
    chunks = [Chunk(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    made = build_heightmaps(surface, chunks, HILLS, 5)
    for x in (-1, 0):
        for y in (-1, 0, 1):
            west, east = made[Chunk(x, y)].heights, made[Chunk(x + 1, y)].heights
            south, north = made[Chunk(y, x)].heights, made[Chunk(y, x + 1)].heights
            assert np.array_equal(west[:, -1], east[:, 0])
            assert np.array_equal(south[-1], north[0])
    backwards = build_heightmaps(surface, chunks[::-1], HILLS, 5)
    alone = build_heightmaps(surface, [Chunk(0, 0)], HILLS, 5)
    assert all(np.array_equal(made[c].heights, backwards[c].heights) for c in chunks)
    assert np.array_equal(made[Chunk(0, 0)].heights, alone[Chunk(0, 0)].heights)


def test_relief_is_seeded_and_grows_with_the_distance_from_the_road(make_surface):
    surface = make_surface(shapely.box(-300.0, 97.0, 500.0, 104.0), level)
    chunks = [Chunk(0, 0), Chunk(0, 1)]
    first, again, other = (build_heightmaps(surface, chunks, HILLS, seed) for seed in (1, 1, 2))
    assert np.array_equal(first[chunks[0]].heights, again[chunks[0]].heights)
    assert not np.allclose(first[chunks[0]].heights, other[chunks[0]].heights)
    far = np.abs(first[chunks[1]].heights - 31.5)
    near = np.abs(first[chunks[0]].heights[122:136] - 31.5)
    assert near.max() < 0.2 * far.max()
    assert 1.0 < far.max() <= 2 * HILLS.relief


def test_flat_country_is_flat(make_surface, areas):
    surface = make_surface(areas["cross"], level)
    made = build_heightmaps(surface, [Chunk(0, 0), Chunk(4, -7)], FLAT, 0)
    assert all(np.allclose(m.heights, 31.5, atol=1e-9) for m in made.values())


def test_decks_do_not_move_the_ground(make_surface, areas):
    surface = make_surface(areas["straight"], wavy)
    lifted = replace(
        surface,
        vertices=np.concatenate([surface.vertices, surface.vertices + np.array([0.0, 0.0, 9.0])]),
        triangles=np.concatenate([surface.triangles, surface.triangles + len(surface.vertices)]),
        triangle_patch=np.tile(surface.triangle_patch, 2),
        triangle_level=np.repeat([0, 1], len(surface.triangles)),
    )
    plain = build_heightmaps(surface, [Chunk(0, 0)], FLAT, 0)[Chunk(0, 0)]
    assert np.array_equal(
        build_heightmaps(lifted, [Chunk(0, 0)], FLAT, 0)[Chunk(0, 0)].heights, plain.heights
    )
