"""Harbours: containers on each other in one grid across chunks, bollards along the water."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.quays import CONTAINER, EDGE, MOORING, TIERS, place_quays
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.models.environment_profile import YardRules
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap

YARD = shapely.box(120.0, 110.0, 330.0, 190.0)
BASIN = shapely.box(120.0, 90.0, 330.0, 110.0)
OFFICE = shapely.box(150.0, 130.0, 170.0, 145.0)
DEGREES = 20.0


def harbour(by_place, chunk, stacks=1.0):
    x, y = np.meshgrid(*chunk.cell_centres())
    classes = np.full((LANDUSE_CELLS, LANDUSE_CELLS), LanduseClass.GRASS, np.uint8)
    classes[shapely.contains_xy(YARD, x, y)] = LanduseClass.QUAY
    classes[shapely.contains_xy(BASIN, x, y)] = LanduseClass.WATER
    rows = np.full(classes.shape, round(100 * DEGREES))
    landuse = LanduseMap(chunk, classes, np.zeros(classes.shape, np.int64), rows)
    ground = Ground(HeightMap(chunk, np.full((HEIGHT_SAMPLES, HEIGHT_SAMPLES), 7.0)))
    plan = RoadPlan(np.empty((0, 3, 2)))
    scene = Scene(chunk, by_place, plan, Footprints([OFFICE]), ground, 0)
    return place_quays(scene, landuse, YardRules(stacks=stacks))


@pytest.fixture(scope="module")
def objects(by_place):
    return [each for x in (0, 1) for each in harbour(by_place, Chunk(x, 0))]


def places(objects, template):
    found = [each.placement for each in objects if each.placement.template == template]
    return np.array([placement.position for placement in found])


def test_containers_stand_on_the_yard_clear_of_its_border_and_of_buildings(objects):
    boxes = []
    for each in objects:
        if each.placement.template != "container":
            continue
        assert each.placement.heading == pytest.approx(np.radians(DEGREES), abs=1e-5)
        x, y = CONTAINER[:2]
        box = shapely.affinity.rotate(shapely.box(-x / 2, -y / 2, x / 2, y / 2), DEGREES)
        boxes.append(shapely.affinity.translate(box, *each.placement.position[:2]))
    assert len(boxes) > 100
    assert shapely.covers(YARD.buffer(-EDGE + 1.2), boxes).all()
    assert shapely.distance(boxes, OFFICE).min() > 0.3
    assert len({each.id for each in objects}) == len(objects)


def test_containers_stand_on_each_other_and_no_two_share_space(objects):
    points = places(objects, "container")
    stacks, number = np.unique(points[:, :2].round(3), axis=0, return_inverse=True)
    for stack in range(len(stacks)):
        heights = np.sort(points[number == stack, 2])
        expected = 7.0 + CONTAINER[2] * np.arange(len(heights))
        np.testing.assert_allclose(heights, expected, atol=0.002)
        assert len(heights) <= TIERS
    turn = np.radians(DEGREES)
    local = stacks @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    apart = np.abs(local[:, None] - local)
    overlap = (apart[..., 0] < CONTAINER[0]) & (apart[..., 1] < CONTAINER[1])
    assert overlap.sum() == len(stacks)


def test_the_share_of_the_environment_decides(by_place):
    def count(share):
        return len(
            np.unique(places(harbour(by_place, Chunk(1, 0), share), "container")[:, :2], axis=0)
        )

    assert not [o for o in harbour(by_place, Chunk(1, 0), 0.0) if "container" in o.id]
    assert count(0.5) == pytest.approx(0.5 * count(1.0), rel=0.3)


def test_bollards_stand_at_the_water_and_face_it(objects):
    points = places(objects, "mooring")
    assert len(points) >= 8
    assert np.all(np.abs(points[:, 1] - 111.6) < 0.8)
    assert np.diff(np.sort(points[:, 0])).min() >= MOORING - 1e-6
    for each in objects:
        if each.placement.template == "mooring":
            assert each.placement.heading == pytest.approx(-np.pi / 2, abs=0.1)


def test_land_without_a_harbour_has_none(by_place):
    assert harbour(by_place, Chunk(5, 5)) == ()
