"""Hedges, fences, walls and street furniture."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
import trimesh

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints, footprint_of
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.enclosed_plots import Enclosed, Gate
from envgen_usd.city.plots.enclosures import place_enclosures
from envgen_usd.city.plots.strip_bodies import as_polygons, post_body, strip_body
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.layers.prop_choices import choose_props
from envgen_usd.models.environment_profile import FurnitureRules
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, Plot


def mesh_of(polygons):
    corners = polygons.points[triangulate(polygons)[0]].reshape(-1, 3)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    return trimesh.Trimesh(vertices, index.reshape(-1, 3), process=False)


def test_bodies_along_a_line_are_closed_and_as_large_as_they_should_be():
    line = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
    ground = np.array([0.0, 0.5, 0.2])
    mesh = mesh_of(as_polygons(strip_body(line, 0.4, ground, ground + 1.0)))
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    # The mitre takes away as much on the inside as it adds on the outside.
    assert mesh.volume == pytest.approx(7.0 * 0.4 * 1.0, rel=1e-2)
    post = mesh_of(as_polygons(post_body(np.array([1.0, 2.0]), 0.1, -0.2, 1.3)))
    assert post.is_watertight
    assert post.volume == pytest.approx(0.1 * 0.1 * 1.5)
    np.testing.assert_allclose(post.bounds.mean(axis=0), [1.0, 2.0, 0.55])


@pytest.mark.parametrize(("country", "area"), [("1", "residential"), ("2", "residential")])
def test_enclosures_stand_on_their_plots_and_leave_the_door_free(make_map, country, area):
    scene = make_map(country, area)
    plots = {plot.id: shapely.Polygon(plot.polygon) for plot in scene.plots}
    found = [
        thing
        for city in scene.cities
        for thing in city.of_kind("PlantCover", "CityFurniture")
        if thing.id.split("_")[0] in ("hedge", "fence", "wall", "gate")
    ]
    assert {thing.kind for thing in found} == {"PlantCover", "CityFurniture"}
    houses = {b.id: b for city in scene.cities for b in city.of_kind("Building")}
    for thing in found:
        kind, plot = thing.id.split("_", 1)
        plot = plot if thing.placement is None else plot.rsplit("_", 1)[0]
        shape = footprint_of(thing)
        assert plots[plot].buffer(0.1).covers(shape)
        house = houses[f"building_{plot}"]
        walls = [s.polygons.points[:, :2] for s in house.surfaces if s.kind == "GroundSurface"]
        assert shapely.MultiPoint(np.concatenate(walls)).convex_hull.distance(shape) > 0.05
        doors = [o for s in house.surfaces for o in s.openings if o.kind == "DoorSurface"]
        for door in doors:
            middle = door.polygons.points[:, :2].mean(axis=0)
            across = np.array([0.0, 3.0 if "_r" in plot else -3.0])
            way = shapely.LineString([middle, middle + across])
            assert kind == "gate" or not shapely.intersects(way, shape)


def test_plots_of_houses_without_a_door_are_enclosed(make_map):
    """Doors of 0.2 m are too narrow for any door; the enclosure then needs no gate."""
    scene = make_map("2", "residential", door=0.2)
    houses = [b for city in scene.cities for b in city.of_kind("Building")]
    surfaces = [surface for house in houses for surface in house.surfaces]
    assert surfaces
    assert not [o for s in surfaces for o in s.openings if o.kind == "DoorSurface"]
    things = [t for city in scene.cities for t in city.of_kind("PlantCover", "CityFurniture")]
    assert {"hedge", "fence"} & {thing.id.split("_")[0] for thing in things}


def test_panels_of_a_fence_meet_at_the_ground(make_map):
    """Ends of neighbours along a straight run are equal points, on the fixture's ground."""
    scene = make_map("2", "residential")
    panels = [t for city in scene.cities for t in city.of_kind("CityFurniture")
              if t.placement is not None and t.placement.template == "fence"]  # fmt: skip
    assert len(panels) > 40
    shared = 0
    for first, second in pairwise(panels):
        (start, end), (after, _) = ends_of(first.placement), ends_of(second.placement)
        shared += np.linalg.norm(after - end) < 0.01
        for place in (start, end):
            # The fixture's ground rises beside the road.
            ground = max(abs(place[1] - 100.0) - 6.0, 0.0) * 0.05
            assert place[2] == pytest.approx(ground, abs=0.02)
    assert shared > 0.6 * len(panels)
    assert {panel.placement.size[2] for panel in panels} == {
        panel.attributes["height"] for panel in panels
    }


def ends_of(placement):
    """Both ends of what runs along y, 2 x 3, by the turns that a placement states."""
    cos, sin = np.cos(placement.heading), np.sin(placement.heading)
    along = np.array([-sin * np.cos(placement.roll), cos * np.cos(placement.roll),
                      np.sin(placement.roll)])  # fmt: skip
    return placement.position + np.array([[-0.5], [0.5]]) * placement.size[1] * along


def test_a_gate_fills_the_gap_before_a_door_and_has_the_design_of_its_fence(
    make_map, by_place, chunks
):
    scene = make_map("2", "residential")
    rules = replace(scene.profile.enclosures, kinds={"fence": 1.0}, gates=1.0)
    profile = replace(scene.profile, enclosures=rules)
    library = read_catalogue()
    gates = 0
    for chunk in chunks:
        plan = plan_city(chunk, scene.plots, by_place, scene.heights[chunk], profile, 0)
        city = build_city(plan, scene.landuse[chunk], profile, roads=False)
        things = {t.id: t for t in city.of_kind("CityFurniture") if t.placement is not None}
        props = {prop.id: prop for prop in choose_props(city, {}, profile, library, 0)}
        posts = np.array([ends_of(t.placement) for t in things.values()
                          if t.placement.template == "fence"]).reshape(-1, 3)  # fmt: skip
        for name, thing in things.items():
            if thing.placement.template == "gate":
                gates += 1
                away = np.linalg.norm(ends_of(thing.placement)[:, None] - posts[None], axis=2)
                assert (away.min(axis=1) < 0.15).all()
                gate = props[name].choice
                assert gate.asset.fits(thing.placement.size[1])
                plot = name.removeprefix("gate_").rsplit("_", 1)[0]
                fence = props[f"fence_{plot}_0"].choice.selections
                assert gate.selections["timber"] == fence["timber"]
                if fence["design"] in gate.asset.variants["design"]:
                    assert gate.selections["design"] == fence["design"]
    assert gates > 3


def rings_of(polygons):
    return [polygons.rings(p)[0] for p in range(len(polygons))]


def flat(ring):
    return shapely.Polygon(ring[:, :2]).area > 1e-6


def test_furniture_stands_on_the_sidewalk_and_looks_at_the_road(make_map):
    scene = make_map("1", "residential")
    found = [
        thing
        for city in scene.cities
        for thing in city.of_kind("CityFurniture")
        if thing.placement is not None
        and thing.placement.template not in {"street_light", "fence", "gate"}
        and "_garden_" not in thing.id
    ]
    assert {"bin", "bollard", "pole", "street_sign"} <= {t.placement.template for t in found}
    gullies = [thing for thing in found if thing.placement.template == "gully"]
    assert gullies
    assert len(found) - len(gullies) >= 25
    for gully in gullies:
        # In the gutter, before the kerb at 96.5.
        assert 96.6 < gully.placement.position[1] < 97.0
    for thing in found:
        if thing.placement.template == "gully":
            continue
        x, y, z = thing.placement.position
        # The sidewalk lies between y = 94.5 and 96.5, its kerb at 96.5; the fixture has no rise.
        assert 94.6 < y < 96.4
        assert z == 0.0
        assert 0.0 < x < 400.0
        kind = thing.placement.template
        # The road lies to the north; traffic beside the sidewalk runs east, and signs look west.
        ahead = np.pi if kind in {"street_sign", "hoarding"} else np.pi / 2
        assert np.cos(thing.placement.heading - ahead) == pytest.approx(1.0)
        away = kind in {"bench", "bin", "control_box", "hoarding", "mailbox", "phone_box"}
        assert (y < 95.5) == away
    assert len({thing.id for thing in found}) == len(found)


def test_furniture_fills_the_sidewalk_and_leaves_its_ends_free(make_map, by_place, chunks):
    """The sidewalk is 400 m long; 5 m at its ends are free, of which groups may take a half."""
    scene = make_map("1", "residential")
    profile = replace(
        scene.profile, furniture=FurnitureRules(bench=2.0, bin=0, bollard=4.0, hydrant=0)
    )
    found = {"bench": [], "bollard": []}
    for chunk in chunks:
        plan = plan_city(chunk, (), by_place, scene.heights[chunk], profile, 0)
        city = build_city(plan, scene.landuse[chunk], profile)
        for thing in city.of_kind("CityFurniture"):
            if thing.placement is not None and thing.placement.template in found:
                found[thing.placement.template].append(thing.placement.position[0])
    assert 5.0 <= min(found["bench"]) < 15.0
    assert 390.0 < max(found["bench"]) <= 395.0
    assert 390.0 < max(found["bollard"]) <= 397.5
    # A group of four stands on 4.5 m.
    assert len(found["bollard"]) > 2 * 100
    assert set(np.round(np.diff(sorted(found["bollard"])), 3)) & {1.5}


def test_kinds_of_furniture_keep_apart_and_behind_the_kerb(make_map, by_place, chunks):
    """Boxes of the assets along the road (x), of one side of the sidewalk, do not overlap."""
    rules = FurnitureRules(
        bench=6, bin=6, bollard=15, hydrant=12, control_box=10, mailbox=10, parking_meter=9,
        pole=8, street_sign=9,
    )  # fmt: skip
    scene = make_map("1", "residential")
    profile = replace(scene.profile, furniture=rules)
    library = read_catalogue()
    sides = {True: [], False: []}
    for chunk in chunks:
        plan = plan_city(chunk, (), by_place, scene.heights[chunk], profile, 0)
        for thing in build_city(plan, scene.landuse[chunk], profile).of_kind("CityFurniture"):
            kind = thing.placement.template if thing.placement else ""
            if kind in vars(rules):
                x, y, _ = thing.placement.position
                asset = library.assets["traffic_sign" if kind == "street_sign" else kind]
                deep, wide, _ = asset.size({})
                across = wide if kind == "street_sign" else deep
                along = deep if kind == "street_sign" else wide
                sides[y < 95.5].append((x, along, kind))
                assert y + across / 2 <= 96.5 - 0.3 + 1e-6, kind
    assert min(map(len, sides.values())) > 60
    for stood in sides.values():
        stood.sort()
        for (x, along, kind), (other, its, next_kind) in pairwise(stood):
            if kind != next_kind:
                assert other - x >= (along + its) / 2, (kind, next_kind)


def flat_scene(by_place):
    chunk = Chunk(0, 0)
    ground = Ground(HeightMap(chunk, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))))
    plan = RoadPlan(by_place.triangles_near(chunk.bounds, 0.0))
    return Scene(chunk, by_place, plan, Footprints([]), ground, 0)


@pytest.mark.parametrize("kind", ["hedge", "wall"])
def test_a_road_cuts_enclosures_that_it_reaches_into(by_place, kind):
    """The tip of a triangle ends within the body, between the points at which heights are taken."""
    corners = np.array([[0, 0], [20, 0], [20, 30], [0, 30]]) + np.array([20.0, 120.0])
    plot = Plot("plot_1", corners, LanduseClass.LAWN, corners[:2])
    tip = np.array([[32.7, 160.0], [32.9, 160.0], [32.8, 149.75]])
    scene = replace(flat_scene(by_place), road=RoadPlan(tip[None]))
    rules = replace(read_profile("2", "residential").enclosures, kinds={kind: 1.0}, gates=0.0)
    enclosed = Enclosed(plot, shapely.box(27.0, 127.0, 33.0, 137.0), ())
    (cut,) = place_enclosures(scene, [enclosed], [plot], rules)
    (whole,) = place_enclosures(flat_scene(by_place), [enclosed], [plot], rules)
    road = shapely.Polygon(tip)
    assert footprint_of(whole).distance(road) == 0.0
    assert footprint_of(cut).distance(road) > 0.0
    assert footprint_of(cut).area > 0.97 * footprint_of(whole).area


def test_an_enclosure_that_leaves_out_a_small_step_keeps_off_the_road(by_place):
    """A step of 0.5 m in the border is too small for a wall; across it lies a road."""
    corners = [[20, 120], [40, 120], [40, 150], [30, 150], [30, 149.5], [20, 149.5]]
    plot = Plot("plot_1", np.array(corners, float), LanduseClass.LAWN, np.array(corners[:2], float))
    tip = np.array([[29.1, 160.0], [29.3, 160.0], [29.2, 149.45]])
    rules = replace(read_profile("2", "residential").enclosures, kinds={"wall": 1.0}, gates=0.0)
    enclosed = Enclosed(plot, shapely.box(27.0, 127.0, 33.0, 137.0), ())
    (whole,) = place_enclosures(flat_scene(by_place), [enclosed], [plot], rules)
    scene = replace(flat_scene(by_place), road=RoadPlan(tip[None]))
    (cut,) = place_enclosures(scene, [enclosed], [plot], rules)
    road = shapely.Polygon(tip)
    assert footprint_of(whole).distance(road) == 0.0
    assert footprint_of(cut).distance(road) > 0.0
    assert footprint_of(cut).area > 0.9 * footprint_of(whole).area


@pytest.mark.parametrize("kind", ["hedge", "wall"])
def test_enclosures_reach_from_below_the_ground_to_their_height(by_place, kind):
    corners = np.array([[0, 0], [20, 0], [20, 30], [0, 30]]) + np.array([20.0, 120.0])
    plot = Plot("plot_1", corners, LanduseClass.LAWN, corners[:2])
    rules = replace(
        read_profile("2", "residential").enclosures, kinds={kind: 1.0}, height=(1.2, 1.2)
    )
    enclosed = Enclosed(plot, shapely.box(27.0, 127.0, 33.0, 137.0), ())
    (feature,) = place_enclosures(flat_scene(by_place), [enclosed], [plot], rules)
    mesh = mesh_of(feature.geometry["lod2MultiSurface"])
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    bodies = mesh.split()
    for body in bodies:
        assert body.volume > 0.0
        low, high = body.bounds[:, 2]
        assert (-0.5 < low < 0.0 and high == pytest.approx(1.2)) or (0.0 < low < high < 1.2)
    assert any(body.bounds[0, 2] < 0.0 for body in bodies)


def test_a_house_without_a_door_is_enclosed_all_around(by_place):
    """A narrow house can have its only column of windows behind a wing."""
    scene = flat_scene(by_place)
    corners = np.array([[0, 0], [20, 0], [20, 30], [0, 30]]) + np.array([20.0, 120.0])
    plot = Plot("plot_1", corners, LanduseClass.LAWN, corners[:2])
    rules = replace(read_profile("2", "residential").enclosures, kinds={"wall": 1.0})
    house = shapely.box(27.0, 127.0, 33.0, 137.0)
    closed, open_ = (
        place_enclosures(scene, [Enclosed(plot, house, gates)], [plot], rules)[0]
        for gates in ((), (Gate(np.array([30.0, 127.0]), np.array([30.0, 120.0]), 1.0),))
    )
    before_door = shapely.Point(30.0, 120.3).buffer(0.5)
    assert plan_of(closed).intersects(before_door)
    assert not plan_of(open_).intersects(before_door)


def plan_of(feature):
    rings = rings_of(feature.geometry["lod2MultiSurface"])
    return shapely.union_all(shapely.polygons([ring[:, :2] for ring in rings if flat(ring)]))
