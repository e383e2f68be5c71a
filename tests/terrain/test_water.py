"""Water lies below the land: level basins between walls, sloping shores, rivers that fall."""

import numpy as np
import pytest
import shapely
from tests.terrain.test_ground import chunks_on, directed_edges, face_areas, open_edges, road_edges

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.terrain.ground_mesh import build_ground
from envgen_usd.terrain.heightmaps import build_heightmaps
from envgen_usd.terrain.water_levels import SHORE, lower_water

RULES = TerrainRules(0.0, 100.0, 0.5, bank_height=0.6, quay_height=2.4)
CHUNKS = (Chunk(0, 0), Chunk(1, 0))
BASIN = shapely.affinity.rotate(shapely.box(60.0, 60.0, 330.0, 150.0), 8.0)


def landuse(shapes, chunks=CHUNKS):
    """Maps of shapes with their classes, in drawing order, on grass."""
    maps = {}
    for chunk in chunks:
        x, y = np.meshgrid(*chunk.cell_centres())
        classes = np.full(x.shape, LanduseClass.GRASS, np.uint8)
        for shape, kind in shapes:
            classes[shapely.contains_xy(shape, x, y)] = kind
        maps[chunk] = LanduseMap(chunk, classes, np.zeros(x.shape, np.int64))
    return maps


def land(height, chunks=CHUNKS):
    return {c: HeightMap(c, height(*np.meshgrid(*c.corner_axes()))) for c in chunks}


def flat(x, y):
    return 0.0 * (x + y) + 7.0


def no_road(make_surface):
    return Outline.of(make_surface(shapely.box(-900.0, -900.0, -890.0, -890.0), flat))


def meshes(maps, lowered, outline):
    return [build_ground(lowered[chunk], outline, maps[chunk]) for chunk in maps]


def water_heights(mesh, maps):
    of_water = maps[mesh.chunk].classes.ravel()[mesh.face_cell] == LanduseClass.WATER
    corners = np.repeat(of_water & ~mesh.is_wall, mesh.face_sizes)
    return mesh.vertices[mesh.face_vertices[corners], 2]


def walls(mesh):
    """Corners of the walls of a mesh, and the face of each."""
    sizes = mesh.face_sizes[mesh.is_wall]
    corners = mesh.vertices[mesh.face_vertices[len(mesh.face_vertices) - sizes.sum() :]]
    return corners, np.repeat(np.arange(len(sizes)), sizes)


def inner_open_edges(edges, chunks):
    rim = shapely.union_all([shapely.box(*chunk.bounds) for chunk in chunks]).boundary
    middle = shapely.points(open_edges(edges)[..., :2].mean(axis=1))
    return np.sum(shapely.distance(rim, middle) > 1e-6)


@pytest.fixture(scope="module")
def basin(make_surface):
    maps = landuse([(BASIN.buffer(9.0), LanduseClass.QUAY), (BASIN, LanduseClass.WATER)])
    lowered = lower_water(land(flat), maps, RULES)
    return maps, lowered, meshes(maps, lowered, no_road(make_surface))


def test_the_water_of_a_basin_is_level_across_chunks(basin):
    maps, _, ground = basin
    heights = np.concatenate([water_heights(mesh, maps) for mesh in ground])
    np.testing.assert_allclose(heights, 7.0 - RULES.quay_height, atol=1e-9)


def test_quay_walls_are_upright_straight_and_as_long_as_the_quay(basin):
    _, _, ground = basin
    length = 0.0
    for mesh in ground:
        corners, face = walls(mesh)
        for number in range(face.max() + 1):
            wall = corners[face == number]
            assert len(wall) == 4
            np.testing.assert_array_equal(wall[[0, 1], :2], wall[[3, 2], :2])
            np.testing.assert_allclose(wall[:, 2], [4.6, 4.6, 7.0, 7.0], atol=1e-9)
            length += np.hypot(*(wall[1] - wall[0])[:2])
            # From the water, corners run counter-clockwise: the wall faces the basin.
            ahead = wall[1, :2] - wall[0, :2]
            middle = wall[:2, :2].mean(axis=0)
            front = middle + 1.5 * np.array([ahead[1], -ahead[0]]) / np.hypot(*ahead)
            assert shapely.contains_xy(BASIN, *front)
        beside = shapely.distance(BASIN.boundary, shapely.points(corners[:, :2]))
        assert beside.max() < CELL_SIZE
        assert np.median(beside) < 0.6 * CELL_SIZE
    assert length == pytest.approx(BASIN.length, rel=0.015)


def test_a_basin_leaves_no_open_edge_and_covers_the_same_plan(basin):
    maps, _, ground = basin
    edges = np.concatenate([directed_edges(mesh) for mesh in ground])
    assert inner_open_edges(edges, maps) == 0
    for mesh in ground:
        assert face_areas(mesh)[~mesh.is_wall].sum() == pytest.approx(40000.0, abs=1e-3)


def test_heights_of_the_quay_are_those_of_the_land(basin):
    maps, lowered, _ = basin
    for chunk, heightmap in lowered.items():
        on_quay = maps[chunk].classes == LanduseClass.QUAY
        assert (heightmap.heights[:-1, :-1][on_quay] == 7.0).all()
        assert (heightmap.heights[1:, 1:][on_quay] == 7.0).all()


def test_a_lake_has_sloping_shores_and_no_wall(make_surface):
    lake = shapely.Point(200.0, 100.0).buffer(60.0)
    maps = landuse([(lake, LanduseClass.WATER)])
    lowered = lower_water(land(flat), maps, RULES)
    for mesh in meshes(maps, lowered, no_road(make_surface)):
        assert mesh.walls == 0
        np.testing.assert_allclose(water_heights(mesh, maps), 6.4, atol=1e-9)
    heights = lowered[Chunk(0, 0)].heights
    assert np.abs(np.diff(heights, axis=0)).max() <= RULES.bank_slope * CELL_SIZE + 1e-9
    x, y = np.meshgrid(*Chunk(0, 0).corner_axes())
    far = shapely.distance(lake, shapely.points(x, y)) > SHORE + CELL_SIZE
    np.testing.assert_array_equal(heights[far], 7.0)


def test_a_pier_does_not_make_a_harbour_of_a_lake():
    lake = shapely.Point(200.0, 100.0).buffer(60.0)
    pier = shapely.box(130.0, 99.0, 160.0, 102.0)
    maps = landuse([(lake, LanduseClass.WATER), (pier, LanduseClass.QUAY)])
    lowered = lower_water(land(flat), maps, RULES)
    assert lowered[Chunk(0, 0)].heights.min() == pytest.approx(6.4)


def test_a_river_falls_with_its_valley_and_never_rises_above_its_banks(make_surface):
    def valley(x, y):
        return 20.0 - 0.02 * x + 0.1 * np.abs(y - 100.0)

    river = shapely.box(0.0, 95.0, 400.0, 105.0)
    maps = landuse([(river, LanduseClass.WATER)])
    before = land(valley)
    lowered = lower_water(before, maps, RULES)
    for chunk, heightmap in lowered.items():
        assert (heightmap.heights <= before[chunk].heights + 1e-9).all()
        middle = heightmap.heights[128]
        assert (np.diff(middle) <= 0.0).all()
        drop = before[chunk].heights[128] - middle
        assert drop.min() >= RULES.bank_height - 0.002
        assert drop.max() < RULES.bank_height + 1.0
    left, right = (lowered[chunk].heights for chunk in CHUNKS)
    np.testing.assert_array_equal(left[:, -1], right[:, 0])
    ground = meshes(maps, lowered, no_road(make_surface))
    edges = np.concatenate([directed_edges(mesh) for mesh in ground])
    assert inner_open_edges(edges, CHUNKS) == 0


def test_a_road_at_the_water_keeps_its_height_and_gets_a_wall(make_surface, areas):
    area = areas["cross"]
    surface, chunks = make_surface(area, flat), chunks_on(areas["cross"])
    road = [(area, LanduseClass.ROAD)]
    water = shapely.box(-90.0, 0.0, 300.0, 120.0).difference(area.buffer(1.7))
    maps = landuse(
        [(water.buffer(3.0), LanduseClass.VERGE), (water, LanduseClass.WATER), *road], chunks
    )
    rules = TerrainRules(0.0, 100.0, 0.1, bank_height=1.5)
    lowered = lower_water(build_heightmaps(surface, chunks, RULES, 0), maps, rules)
    ground = meshes(maps, lowered, Outline.of(surface))
    assert sum(mesh.walls for mesh in ground) > 100
    edges = np.concatenate([road_edges(surface), *map(directed_edges, ground)])
    assert inner_open_edges(edges, chunks) == 0


def test_water_of_a_chunk_does_not_depend_on_the_others_that_are_wanted():
    shapes = [(BASIN.buffer(9.0), LanduseClass.QUAY), (BASIN, LanduseClass.WATER)]
    maps, heights = landuse(shapes), land(flat)
    whole = lower_water(heights, maps, RULES)
    (alone,) = lower_water(heights, maps, RULES, CHUNKS[1:]).values()
    np.testing.assert_array_equal(alone.heights, whole[CHUNKS[1]].heights)


def test_land_without_water_stays_the_same():
    heights = land(flat)
    assert lower_water(heights, landuse([]), RULES) == heights
