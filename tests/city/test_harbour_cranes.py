"""Cranes of harbours stand on rails along straight quays and face the water."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints, footprint_of
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.harbour_cranes import GAUGES, RAIL, is_crane, place_cranes
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.environment_files import read_profile
from envgen_usd.models.environment_profile import PropRules, YardRules
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap

CHUNK = Chunk(0, 0)
PROFILE = read_profile("1", "harbour")
DEGREES = 12.0
SHED = shapely.box(80.0, 96.0, 100.0, 110.0)


def turned(shape):
    return shapely.affinity.rotate(shape, DEGREES, origin=(100.0, 100.0))


BASIN = turned(shapely.box(20.0, 60.0, 180.0, 90.0))


def cranes(by_place, width, spacing=40.0, taken=(), props=None):
    """Cranes of a quay of a width north of a basin."""
    x, y = np.meshgrid(*CHUNK.cell_centres())
    classes = np.full((LANDUSE_CELLS, LANDUSE_CELLS), LanduseClass.GRASS, np.uint8)
    quay = turned(shapely.box(20.0, 90.0, 180.0, 90.0 + width))
    classes[shapely.contains_xy(quay, x, y)] = LanduseClass.QUAY
    classes[shapely.contains_xy(BASIN, x, y)] = LanduseClass.WATER
    landuse = LanduseMap(CHUNK, classes, np.zeros(classes.shape, np.int64))
    ground = Ground(HeightMap(CHUNK, np.full((HEIGHT_SAMPLES, HEIGHT_SAMPLES), 7.0)))
    road = RoadPlan(np.empty((0, 3, 2)))
    scene = Scene(CHUNK, by_place, road, Footprints(taken), ground, 0)
    profile = replace(PROFILE, yard=YardRules(cranes=spacing), props=props or {})
    return place_cranes(scene, landuse, profile)


def places(made):
    return np.array([each.placement.position for each in made.features if is_crane(each)])


def test_cranes_face_the_water_from_between_their_rails(by_place):
    made = cranes(by_place, 30.0)
    found = [each for each in made.features if is_crane(each)]
    assert len(found) >= 3
    for crane in found:
        gauge = GAUGES[crane.attributes["design"]][0]
        place = shapely.Point(crane.placement.position[:2])
        assert BASIN.distance(place) == pytest.approx(RAIL + gauge / 2.0, abs=0.9)
        assert crane.placement.position[2] == pytest.approx(7.0)
        expected = np.radians(DEGREES - 90.0)
        assert np.cos(crane.placement.heading - expected) > np.cos(np.radians(3.0))
    assert {crane.attributes["design"] for crane in found} <= set(GAUGES)


def test_rails_lie_on_the_quay_along_the_water(by_place):
    made = cranes(by_place, 30.0)
    quay = turned(shapely.box(20.0, 90.0, 180.0, 120.0))
    rails = [each for each in made.features if not is_crane(each)]
    assert len(rails) == len(made.tracks)
    for each, track in zip(rails, made.tracks, strict=True):
        plan = footprint_of(each)
        assert quay.contains(plan)
        assert quay.buffer(0.1).contains(track)
        assert plan.distance(BASIN) == pytest.approx(RAIL, abs=0.9)
        heights = each.geometry["lod2MultiSurface"].points[:, 2]
        assert 7.0 < heights.max() < 7.05


def test_cranes_keep_their_distance_and_free_tracks(by_place):
    made = cranes(by_place, 30.0, spacing=45.0)
    points = places(made)[:, :2]
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    # The spacing is that of places at the water; gauges differ by up to 9 m.
    assert apart[~np.eye(len(points), dtype=bool)].min() > 44.0
    crossed = shapely.STRtree(made.tracks).query(made.tracks, "intersects")
    assert len(crossed[0]) == len(made.tracks)


def test_a_narrow_quay_has_small_cranes_and_a_pier_none(by_place):
    narrow = cranes(by_place, 11.0)
    designs = {e.attributes["design"] for e in narrow.features if is_crane(e)}
    assert designs == {"portal"}
    assert not cranes(by_place, 6.0).features


def test_the_environment_weighs_designs(by_place):
    weights = {"portal": 0.0, "portal_large": 1.0, "gantry": 0.0}
    made = cranes(by_place, 30.0, props={"crane": PropRules(variants={"design": weights})})
    designs = {e.attributes["design"] for e in made.features if is_crane(e)}
    assert designs == {"portal_large"}


def test_nothing_stands_on_the_tracks(by_place):
    shed = turned(shapely.box(60.0, 97.0, 140.0, 112.0))
    made = cranes(by_place, 30.0, taken=[shed])
    assert made.tracks
    assert shapely.distance(made.tracks, shed).min() > 0.0


def test_without_a_spacing_there_are_none(by_place):
    assert not cranes(by_place, 30.0, spacing=0.0).features
