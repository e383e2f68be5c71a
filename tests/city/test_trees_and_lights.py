"""Trees and street lights: where they stand, how many, and that chunks do not depend on others."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree

from envgen_usd.chunks import HEIGHT_SAMPLES
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.spread_places import spread
from envgen_usd.city.plots.street_lights import place_street_lights
from envgen_usd.city.plots.street_trees import place_street_trees
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.citygml.write import write_city
from envgen_usd.environment_files import read_profile
from envgen_usd.models.city_model import City
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

ENVIRONMENTS = [("1", "residential"), ("2", "industrial")]


def places(features):
    return np.array([feature.placement.position for feature in features])


def street_lights(scene):
    return [
        thing
        for city in scene.cities
        for thing in city.of_kind("CityFurniture")
        if thing.placement is not None and thing.placement.template == "street_light"
    ]


def trees(*cities, template="tree"):
    return [
        tree
        for city in cities
        for tree in city.of_kind("SolitaryVegetationObject")
        if tree.placement.template == template
    ]


def test_spread_is_dart_throwing():
    points = np.random.default_rng(1).uniform(0, 30, (600, 2))
    thrown = []
    for index, point in enumerate(points):
        if all(np.hypot(*(point - points[other])) > 1.7 for other in thrown):
            thrown.append(index)
    np.testing.assert_array_equal(np.flatnonzero(spread(points, 1.7)), thrown)


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_trees_keep_clear(make_map, country, area):
    scene = make_map(country, area)
    rules = scene.profile.trees
    scattered = trees(*scene.cities)
    points = places(scattered)
    # From one another, also over the chunk border; from the road; from houses; from lights.
    assert cKDTree(points[:, :2]).query(points[:, :2], k=2)[0][:, 1].min() >= rules.spacing
    y = points[:, 1]
    assert ((y < 94.5 - rules.clearance) | (y > 103.62 + rules.clearance)).all()
    lights = places(street_lights(scene))
    assert cKDTree(lights[:, :2]).query(points[:, :2])[0].min() >= rules.clearance
    grounds = [
        shapely.Polygon(s.polygons.points[:, :2])
        for city in scene.cities
        for building in city.of_kind("Building")
        for s in building.surfaces
        if s.kind == "GroundSurface"
    ]
    _, distance = shapely.STRtree(grounds).query_nearest(
        shapely.points(points[:, :2]), return_distance=True, all_matches=False
    )
    assert distance.min() >= rules.clearance
    crowns = np.array([tree.attributes["crownDiameter"] for tree in scattered])
    assert (crowns / 2 <= distance + 1e-3).all()


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_trees_stand_on_the_ground_with_the_sizes_of_the_environment(make_map, country, area):
    scene = make_map(country, area)
    rules = scene.profile.trees
    for chunk, city in zip(scene.landuse, scene.cities, strict=True):
        scattered = trees(city)
        points = places(scattered)
        assert (np.floor(points[:, :2] / 200.0) == (chunk.x, chunk.y)).all()
        expected = np.maximum(np.abs(points[:, 1] - 100.0) - 6.0, 0.0) * 0.05
        np.testing.assert_allclose(points[:, 2], expected, atol=0.02)
        heights = np.array([tree.attributes["height"] for tree in scattered])
        assert heights.max() <= rules.height[1]
        assert np.median(heights) >= rules.height[0]


def test_density_of_trees_is_that_of_the_landuse(make_map):
    scene = make_map("1", "residential")
    rules = scene.profile.trees
    for chunk, city in zip(scene.landuse, scene.cities, strict=True):
        classes = scene.landuse[chunk].classes
        points = places(trees(city))
        cell = ((points[:, :2] - chunk.origin) / (200 / 255)).astype(int)
        found = classes[cell[:, 1], cell[:, 0]]
        for kind, density in (
            (LanduseClass.GRASS, rules.density),
            (LanduseClass.WOOD, rules.wood_density),
        ):
            hectares = (classes == kind).sum() * (200 / 255) ** 2 / 1e4
            assert (found == kind).sum() == pytest.approx(density * hectares, rel=0.15, abs=4)
        assert not (found == LanduseClass.ROAD).any()


@pytest.fixture
def rows(make_map, by_place, chunks):
    """Function that plants the rows of the road through both chunks, with changed rules."""
    scene = make_map("1", "residential", slope=0.0)

    def plant(houses=(), **changes):
        rules = replace(scene.profile.street_trees, share=1.0, gaps=0.0, **changes)
        plans = [
            plan_city(chunk, (), by_place, scene.heights[chunk], scene.profile, 0)
            for chunk in chunks
        ]
        planted = [place_street_trees(plan.scene, houses, rules) for plan in plans]
        return rules, [tree for row in planted for tree in row]

    return plant


def test_street_trees_stand_at_the_kerb_of_a_wide_sidewalk_and_behind_the_road_else(rows):
    rules, planted = rows(sides="both", jitter=0.0)
    points = places(planted)
    left = points[:, 1] > 100.0
    np.testing.assert_allclose(points[~left, 1], 96.5 - 0.6, atol=1e-3)
    off = points[left, 1] - 103.62
    assert rules.offset[0] - 1e-3 <= off.min()
    assert off.max() <= rules.offset[1] + 1e-3
    # One row through both chunks, at even distances.
    gaps = np.diff(np.sort(points[left, 0]))
    np.testing.assert_allclose(gaps, gaps[0], atol=2e-3)
    assert rules.spacing[0] <= gaps[0] <= rules.spacing[1]
    assert {tree.placement.template for tree in planted} == {"street_tree"}
    assert {tree.attributes["avenue"] for tree in planted} == {"7"}
    _, narrow = rows(sides="both", pit_width=2.5)
    assert not ((places(narrow)[:, 1] > 94.5) & (places(narrow)[:, 1] < 103.62)).any()


@pytest.mark.parametrize(("kind", "speed"), [("motorway", 0.0), ("", 36.0)])
def test_motorways_have_no_street_trees(surface, make_map, chunks, kind, speed):
    scene = make_map("1", "residential", slope=0.0)
    fast = replace(surface, roads=(replace(surface.roads[0], town=kind, speed=speed),))
    chunk = chunks[0]
    plan = plan_city(chunk, (), RoadIndex(fast), scene.heights[chunk], scene.profile, 0)
    rules = replace(scene.profile.street_trees, share=1.0)
    assert place_street_trees(plan.scene, (), rules) == ()


def test_crowns_of_street_trees_end_at_houses(rows):
    house = shapely.box(50.0, 105.5, 350.0, 120.0)
    _, planted = rows((house,))
    _, free = rows()
    assert 0 < len(planted) < len(free)
    for tree in planted:
        away = house.distance(shapely.Point(tree.placement.position[:2]))
        assert tree.attributes["crownDiameter"] / 2 <= away + 1e-3


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_street_lights_stand_beside_the_road_and_look_at_it(make_map, country, area):
    scene = make_map(country, area)
    rules = scene.profile.street_lights
    lights = street_lights(scene)
    points = places(lights)
    left = points[:, 1] > 100.0
    off = np.where(left, points[:, 1] - 103.62, 94.5 - points[:, 1])
    assert off.min() >= rules.offset[0] - 1e-3
    assert off.max() <= rules.offset[1] + 1e-3
    # The arm points to the middle of the road.
    heading = np.array([light.placement.heading for light in lights])
    np.testing.assert_allclose(np.sin(heading), np.where(left, -1.0, 1.0), atol=1e-6)
    spacings = [np.diff(np.sort(points[side, 0])) for side in (left, ~left) if side.any()]
    assert len(spacings) == (1 if rules.sides == "one" else 2)
    for spacing in spacings:
        assert rules.spacing[0] * 0.6 < spacing.min()
        assert spacing.max() < rules.spacing[1] * 1.4
        assert spacing.std() > 0.1
    assert {light.placement.template for light in lights} == {"street_light"}
    assert len({light.id for light in lights}) == len(lights)


def test_street_lights_stand_at_the_kerb_of_a_wide_sidewalk(make_map, by_place, chunks):
    scene = make_map("1", "residential", slope=0.0)
    rules = replace(scene.profile.street_lights, sides="both", jitter=0.0, kerb_width=2.0)
    lights = []
    for chunk in chunks:
        plan = plan_city(chunk, (), by_place, scene.heights[chunk], scene.profile, 0)
        lights += place_street_lights(plan.scene, rules)
    points = places(lights)
    left = points[:, 1] > 100.0
    # The sidewalk on the right is 2 m wide; on the left the lights stand behind the road.
    np.testing.assert_allclose(points[~left, 1], 96.5 - 0.6, atol=1e-3)
    off = points[left, 1] - 103.62
    assert rules.offset[0] - 1e-3 <= off.min()
    assert off.max() <= rules.offset[1] + 1e-3
    heading = np.array([light.placement.heading for light in lights])
    np.testing.assert_allclose(np.sin(heading), np.where(left, -1.0, 1.0), atol=1e-6)


ROAD = """
<road id="{y}" length="300" junction="-1">
  <planView><geometry s="0" x="0" y="{y}" hdg="0" length="300"><line/></geometry></planView>
  <lanes><laneSection s="0">
    <left><lane id="1" type="driving"><width sOffset="0" a="{half}" b="0" c="0" d="0"/></lane>
    </left>
    <center><lane id="0" type="none"/></center>
    <right><lane id="-1" type="driving"><width sOffset="0" a="{half}" b="0" c="0" d="0"/></lane>
    </right>
  </laneSection></lanes>
</road>"""


def test_wide_roads_have_lights_of_their_own(chunks, tmp_path):
    """Roads of 8 and 14 m between their outer borders, and a limit between them."""
    text = ROAD.format(y=50, half=4.0) + ROAD.format(y=150, half=7.0)
    path = tmp_path / "roads.xodr"
    path.write_text(f"<OpenDRIVE><header/>{text}</OpenDRIVE>", encoding="utf-8")
    roads = RoadIndex(build_surface(read_network(path)))
    profile = read_profile("1", "residential")
    main = replace(profile.main_street_lights, width=12.0, height=(9.0, 10.0), sides="both")
    lights = []
    for chunk in chunks:
        ground = Ground(HeightMap(chunk, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))))
        plan = RoadPlan(roads.triangles_near(chunk.bounds, 30.0))
        scene = Scene(chunk, roads, plan, Footprints([]), ground, 0)
        lights += place_street_lights(scene, profile.street_lights, main)
    wide = places(lights)[:, 1] > 100.0
    kinds = np.array([light.placement.template for light in lights])
    assert set(kinds[wide]) == {"main_street_light"}
    assert set(kinds[~wide]) == {"street_light"}
    heights = np.array([light.attributes["height"] for light in lights])
    assert ((heights[wide] >= 9.0) & (heights[wide] <= 10.0)).all()
    assert (heights[~wide] <= profile.street_lights.height[1]).all()


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_lights_stray_from_even_places_by_the_jitter_and_no_further(make_map, country, area):
    scene = make_map(country, area)
    rules = scene.profile.street_lights
    lights = street_lights(scene)
    # The number in the road's sequence is the last part of the name, before the side.
    number = np.array([int(light.id.split("_")[-1].rstrip("lr")) for light in lights])
    x = places(lights)[:, 0]
    step, first = np.polyfit(number, x, 1)
    spacing = step * (2 if rules.sides == "alternating" else 1)
    assert rules.spacing[0] * 0.95 < spacing < rules.spacing[1] * 1.05
    stray = x - first - step * number
    assert 0.5 < np.ptp(stray) / (rules.jitter * spacing) <= 2.1


def test_a_chunk_is_the_same_whoever_builds_it(make_map, by_place, chunks, tmp_path):
    scene = make_map("1", "residential")
    chunk = chunks[1]
    level, land, profile = scene.heights[chunk], scene.landuse[chunk], scene.profile
    plots = tuple(reversed(scene.plots))
    again = build_city(plan_city(chunk, plots, by_place, level, profile, 0), land, profile)
    assert sorted(o.id for o in again.objects) == sorted(o.id for o in scene.cities[1].objects)
    other = build_city(plan_city(chunk, plots, by_place, level, profile, 1), land, profile)
    texts = []
    for city in (scene.cities[1], again, other):
        objects = tuple(sorted(city.objects, key=lambda top: top.id))
        write_city(City(objects), tmp_path / "city.gml")
        texts.append((tmp_path / "city.gml").read_bytes())
    assert texts[0] == texts[1]
    assert texts[0] != texts[2]
