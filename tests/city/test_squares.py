"""Furniture of squares: on the square, apart, facing the middle; a map keeps its own."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.squares import place_squares
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.environment_files import read_profile
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, Plot

CORNERS = np.array([[120.0, 130.0], [160.0, 130.0], [160.0, 158.0], [120.0, 158.0]])
SQUARE = Plot("plot_7", CORNERS, LanduseClass.SQUARE, CORNERS[:2], "0", side="left")
MIDDLE = CORNERS.mean(axis=0)
TOWER = shapely.box(118.0, 150.0, 130.0, 160.0)
PROFILE = read_profile("1", "city_centre")
RULES = replace(PROFILE.squares, centres={"fountain": 1.0})


def furnished(by_place, standing=None, rules=RULES, taken=()):
    chunk = Chunk(0, 0)
    ground = Ground(HeightMap(chunk, np.full((HEIGHT_SAMPLES, HEIGHT_SAMPLES), 4.0)))
    plan = RoadPlan(by_place.triangles_near(chunk.bounds, 30.0))
    scene = Scene(chunk, by_place, plan, Footprints(taken), ground, 0)
    return place_squares(scene, [SQUARE], replace(PROFILE, squares=rules), standing)


def of(objects, template):
    return [each for each in objects if each.placement.template == template]


def test_everything_stands_on_the_square(by_place):
    objects = furnished(by_place)
    points = np.array([each.placement.position for each in objects])
    assert shapely.contains_xy(shapely.Polygon(CORNERS), points[:, :2]).all()
    assert np.all(points[:, 2] == 4.0)
    assert len({each.id for each in objects}) == len(objects)
    [fountain] = of(objects, "fountain")
    assert fountain.placement.position[:2] == pytest.approx(MIDDLE)
    for kind in ("street_tree", "street_light", "bench", "planter", "bollard"):
        assert len(of(objects, kind)) >= 3, kind


def test_trees_stand_in_pits_and_benches_face_the_middle(by_place):
    objects = furnished(by_place)
    pits = {tuple(each.placement.position) for each in of(objects, "tree_pit")}
    assert pits == {tuple(each.placement.position) for each in of(objects, "street_tree")}
    for bench in of(objects, "bench"):
        heading = bench.placement.heading
        ahead = np.array([np.cos(heading), np.sin(heading)])
        assert ahead @ (MIDDLE - bench.placement.position[:2]) > 0.0
    # Bollards and planters are between the street and the rest.
    front = max(each.placement.position[1] for each in of(objects, "planter"))
    assert front < min(each.placement.position[1] for each in of(objects, "bench"))


def test_distances_are_those_of_the_environment(by_place):
    for kind, field in (("street_tree", "trees"), ("bench", "benches"), ("bollard", "bollards")):
        none = furnished(by_place, rules=replace(RULES, **{field: 0.0}))
        assert not of(none, kind)
    row = sorted(each.placement.position[0] for each in of(furnished(by_place), "bollard"))
    assert np.diff(row).min() >= RULES.bollards
    assert np.diff(row).max() < RULES.bollards * 1.2


def test_what_stands_already_keeps_its_place(by_place):
    objects = furnished(by_place, taken=[TOWER])
    points = np.array([each.placement.position[:2] for each in objects])
    assert shapely.distance(shapely.points(points), TOWER).min() > 0.3
    assert len(objects) < len(furnished(by_place))


def test_a_square_of_a_map_keeps_its_middle_and_what_it_has(by_place):
    position = np.array([*MIDDLE + 3.0, 4.0])
    bench = CityObject(
        "map_bench_0", "CityFurniture", placement=Placement(position, 0.0, np.zeros(3), "bench")
    )
    tree = replace(bench, id="map_tree", placement=replace(bench.placement, template="tree"))
    bare, given = furnished(by_place, []), furnished(by_place, [bench, tree])
    assert not of(bare, "fountain")
    assert of(bare, "bench")
    assert of(bare, "street_tree")
    assert not of(given, "bench")
    assert not of(given, "street_tree")
    assert of(given, "street_light")


def test_a_narrow_square_stays_empty(by_place):
    narrow = replace(SQUARE, polygon=np.clip(CORNERS, None, [160.0, 136.0]))
    chunk = Chunk(0, 0)
    ground = Ground(HeightMap(chunk, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))))
    scene = Scene(chunk, by_place, RoadPlan(np.empty((0, 3, 2))), Footprints([]), ground, 0)
    assert place_squares(scene, [narrow], PROFILE, None) == ()
