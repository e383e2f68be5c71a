"""Orchards: trees in a grid that keep clear, and that go on in the next chunk."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.orchards import APART, place_orchards
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.environment_files import read_profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap

ORCHARD = (120.0, 130.0, 270.0, 190.0)
"""Least x and y, largest x and y of an orchard across two chunks, metres."""
SHED = shapely.box(150.0, 150.0, 158.0, 156.0)


def trees_of(by_place, chunk, area="agricultural"):
    x, y = np.meshgrid(*chunk.cell_centres())
    x0, y0, x1, y1 = ORCHARD
    classes = np.full((LANDUSE_CELLS, LANDUSE_CELLS), LanduseClass.GRASS, np.uint8)
    classes[(x > x0) & (x < x1) & (y > y0) & (y < y1)] = LanduseClass.ORCHARD
    landuse = LanduseMap(chunk, classes, np.zeros(classes.shape, np.int64))
    ground = Ground(HeightMap(chunk, np.full((HEIGHT_SAMPLES, HEIGHT_SAMPLES), 7.0)))
    plan = RoadPlan(by_place.triangles_near(chunk.bounds, 30.0))
    scene = Scene(chunk, by_place, plan, Footprints([SHED]), ground, 0)
    return place_orchards(scene, landuse, read_profile("1", area))


def test_trees_stand_in_one_grid_across_chunks_and_keep_clear(by_place, chunks):
    trees = [tree for chunk in chunks for tree in trees_of(by_place, chunk)]
    points = np.array([tree.placement.position for tree in trees])
    assert np.all(points[:, 2] == 7.0)
    cell = points[:, :2] / [APART[1], APART[0]]
    assert np.abs(cell - np.round(cell)).max() < 0.05
    assert len(np.unique(np.round(cell), axis=0)) == len(trees)
    x0, y0, x1, y1 = ORCHARD
    inside = shapely.box(x0 + 1.0, y0 + 1.0, x1 - 1.0, y1 - 1.0)
    assert shapely.contains_xy(inside, points[:, :2]).all()
    assert shapely.distance(shapely.points(points[:, :2]), SHED).min() >= 2.0
    # As many as the grid has places: all but those at edges, at the shed and at the border.
    area = (x1 - x0 - 4.0) * (y1 - y0 - 4.0) - shapely.buffer(SHED, 2.0).area
    assert len(trees) == pytest.approx(area / (APART[0] * APART[1]), rel=0.08)
    assert {tree.placement.template for tree in trees} == {"orchard_tree"}
    assert len({tree.id for tree in trees}) == len(trees)


def test_an_environment_without_fruit_trees_takes_its_trees(by_place):
    trees = trees_of(by_place, Chunk(0, 0), "industrial")
    assert {tree.placement.template for tree in trees} == {"tree"}
