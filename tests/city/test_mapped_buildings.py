"""Buildings of a map: closed solids over their footprints, with the map's figures."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.mapped_buildings import build_mapped
from envgen_usd.environment_files import read_profile
from envgen_usd.executors.executor import LocalProcesses
from envgen_usd.geometry.iso19107.fault_report import city_issues
from envgen_usd.models.city_model import City
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.place import Houses

RULES = read_profile("1", "residential").buildings
SQUARE = shapely.box(20.0, 20.0, 32.0, 30.0)
L_SHAPE = shapely.Polygon([(50, 20), (74, 20), (74, 30), (60, 30), (60, 44), (50, 44)])
COURT = shapely.Polygon(
    [(90, 20), (130, 25), (128, 60), (88, 58)], [[(102, 36), (101, 46), (115, 48), (116, 38)]]
)


def houses(*footprints, height=np.nan, storeys=np.nan, roof="", kind="yes", walls=""):
    count = len(footprints)
    words = {"roofs": roof, "kinds": kind, "walls": walls, "landuse": "", "roofing": ""}
    return Houses(
        footprints=np.array(footprints, object),
        heights=np.full(count, height),
        storeys=np.full(count, storeys),
        **{name: np.full(count, word) for name, word in words.items()},
    )


def bodies(*shapes, **figures):
    """Bodies of a single building."""
    given = houses(*shapes, roof=figures.pop("roof", "flat"))
    arrays = {name: np.array(values, float) for name, values in figures.items()}
    return replace(given, groups=np.zeros(len(shapes), int), **arrays)


def build(given, road=(), slope=0.0):
    across = np.linspace(0.0, 200.0, 256)
    ground = Ground(HeightMap(Chunk(0, 0), np.tile(slope * across, (256, 1))))
    return build_mapped(given, ground, np.array(road, float).reshape(-1, 3, 2), RULES, 0, "map")


def walls(building):
    """The area that the building's ground surface covers in plan."""
    plans = []
    for ground in (s for s in building.surfaces if s.kind == "GroundSurface"):
        starts = ground.polygons.ring_offsets
        rings = [ground.polygons.points[a:b, :2] for a, b in pairwise(starts)]
        plans.append(shapely.make_valid(shapely.Polygon(rings[0], rings[1:])))
    return shapely.union_all(plans)


@pytest.mark.parametrize("roof", ["flat", "hipped", "gabled"])
@pytest.mark.parametrize("shape", [SQUARE, L_SHAPE, COURT], ids=["square", "l", "court"])
def test_buildings_are_closed_solids_on_their_footprints(shape, roof):
    (building,) = build(houses(shape, roof=roof), slope=0.05).buildings
    assert not city_issues(City((building,)))
    plan = walls(building)
    # A wing stands back from the side of the main part, so that their roofs meet cleanly.
    away = 0.4 if shape is L_SHAPE and roof != "flat" else 0.01
    assert shapely.hausdorff_distance(plan.exterior, shape.exterior) < away
    assert plan.area == pytest.approx(shape.area, rel=0.1 * away)
    outline = shapely.Polygon(shape.exterior)
    shell = footprint_of(replace(building, children=()))
    assert shapely.buffer(outline, 0.5).covers(shell)
    # Porches and balconies reach farther, and steps down a slope.
    assert shapely.buffer(outline, 3.5).covers(footprint_of(building))


def test_the_floor_lies_above_the_highest_ground_and_the_walls_reach_below_the_lowest():
    (building,) = build(houses(COURT, roof="flat"), slope=0.1).buildings
    z = np.concatenate([s.polygons.points[:, 2] for s in building.surfaces])
    assert z.min() < 0.1 * 88.0
    assert building.attributes["floorHeight"] > 0.1 * 130.0


@pytest.mark.parametrize("shape", [SQUARE, L_SHAPE], ids=["square", "l"])
def test_height_and_storeys_are_the_map_s(shape):
    (building,) = build(houses(shape, height=17.0, storeys=5.0, roof="flat")).buildings
    assert building.attributes["storeysAboveGround"] == 5
    z = np.concatenate([s.polygons.points[:, 2] for s in building.surfaces if s.kind != "Ground"])
    assert z.max() - building.attributes["floorHeight"] == pytest.approx(17.0, abs=1.0)


def test_roofs_and_materials_are_the_map_s():
    flat, hipped = (build(houses(SQUARE, roof=r)).buildings[0] for r in ("flat", "hipped"))
    assert (flat.attributes["roofType"], hipped.attributes["roofType"]) == ("1000", "1040")
    (plaster,) = build(houses(SQUARE, walls="plaster")).buildings
    material = {s.material for s in plaster.surfaces if s.kind == "WallSurface"}
    assert any(name.startswith("plaster") for name in material)
    assert not any(name.startswith("brick") for name in material)


def test_walls_between_neighbours_have_no_openings():
    left, right = shapely.box(20, 20, 30, 30), shapely.box(30, 20, 41, 33)
    built = build(houses(left, right, roof="flat", storeys=3.0)).buildings
    for building in built:
        for surface in building.surfaces:
            middle = surface.polygons.points.mean(0)
            if surface.openings and abs(middle[0] - 30.0) < 0.01:
                assert middle[1] > 30.0  # only beyond the neighbour


def test_houses_leave_the_road_free():
    road = [[(0, 0), (200, 0), (200, 22)], [(0, 0), (200, 22), (0, 22)]]
    on_road = shapely.box(100, 5, 110, 20)
    built = build(houses(SQUARE, on_road, L_SHAPE), road)
    surface = shapely.union_all(shapely.polygons(np.array(road, float)))
    assert len(built.buildings) == 2
    for building in built.buildings:
        assert not shapely.intersects(walls(building), surface)
    kinds = {issue.kind: issue.message for issue in built.issues}
    assert kinds["osm.building_on_road"].startswith("1 buildings")
    assert kinds["osm.building_cut"].startswith("2 buildings")


def test_a_rectangle_does_not_close_a_corner_that_the_road_cuts_off():
    road = [[(20.0, 20.0), (20.15, 20.0), (20.0, 20.15)]]
    (building,) = build(houses(SQUARE, roof="gabled"), road).buildings
    assert not shapely.intersects(walls(building), shapely.Polygon(road[0]))
    assert shapely.hausdorff_distance(walls(building).exterior, SQUARE.exterior) < 0.8


def test_small_houses_of_unknown_height_are_low_where_they_stand_free():
    apart = [shapely.box(x, 20, x + 12, 30) for x in range(0, 160, 20)]
    row = [shapely.box(x, 60, x + 12, 70) for x in range(0, 96, 12)]
    storeys = {
        name: [b.attributes["storeysAboveGround"] for b in build(houses(*shapes)).buildings]
        for name, shapes in (("apart", apart), ("row", row))
    }
    assert max(storeys["apart"]) <= 2
    assert max(storeys["row"]) > 2


def test_bodies_of_a_building_are_closed_parts_that_meet():
    podium, tower = shapely.box(20, 20, 60, 50), shapely.box(30, 30, 40, 40)
    given = bodies(podium, tower, heights=[8, 50], bottoms=[0, 8], storeys=[2, 13])
    (building,) = build(given, slope=0.05).buildings
    assert building.kind == "Building"
    assert not building.surfaces
    low, high = building.children
    assert {low.kind, high.kind} == {"BuildingPart"}
    assert not city_issues(City((building,)))
    assert shapely.hausdorff_distance(walls(low), podium) < 0.01
    # On the roof of the lower body: no foundation, no door, windows on all sides.
    z = [np.concatenate([s.polygons.points[:, 2] for s in part.surfaces]) for part in (low, high)]
    assert z[1].min() == pytest.approx(z[0].max(), abs=1e-3)
    assert z[1].max() - z[0].max() == pytest.approx(42.0, abs=1e-3)
    kinds = Counter(s.kind for s in high.surfaces)
    assert kinds["OuterCeilingSurface"] == 1
    assert kinds["GroundSurface"] == 0
    openings = [o.kind for s in high.surfaces for o in s.openings]
    assert openings
    assert "DoorSurface" not in openings
    assert sum(bool(s.openings) for s in high.surfaces if s.kind == "WallSurface") == 4
    assert any(o.kind == "DoorSurface" for s in low.surfaces for o in s.openings)


def test_a_body_over_a_road_stays_and_those_beside_it_are_its_parts():
    road = [[(40, 0), (46, 0), (46, 80)], [(40, 0), (46, 80), (40, 80)]]
    shapes = [shapely.box(20, 20, 39, 32), shapely.box(39, 20, 47, 32), shapely.box(47, 20, 66, 32)]
    given = bodies(*shapes, heights=[12] * 3, bottoms=[0, 4, 0])
    (building,) = build(given, road).buildings
    assert len(building.children) == 3
    assert not city_issues(City((building,)))
    undersides = [
        s.polygons.points[:, 2].min()
        for part in building.children
        for s in part.surfaces
        if s.kind == "OuterCeilingSurface"
    ]
    assert undersides == pytest.approx([4.1], abs=0.01)


@pytest.mark.parametrize("angle", [17.0, 33.3, 61.0])
def test_bodies_beside_each_other_share_no_space_whatever_their_angle(angle):
    row = [shapely.box(x, 50, x + 11.3, 61.7) for x in (40.0, 51.3, 62.6)]
    shapes = [shapely.affinity.rotate(shape, angle, origin=(60, 60)) for shape in row]
    for roof in ("gabled", "flat"):
        given = bodies(*shapes, roof=roof, heights=[12, 15, 12], bottoms=[0, 4, 0])
        (building,) = build(given).buildings
        assert len(building.children) == 3
        assert not city_issues(City((building,)))


def test_an_uneven_body_does_not_reach_into_the_one_beside_it():
    hall = shapely.Polygon([(20, 20), (40, 20), (40, 32), (30, 31.8), (20, 32)])
    tower = shapely.Polygon([(20, 32), (30, 31.8), (40, 32), (34, 40), (26, 40)])
    given = bodies(hall, tower, roof="gabled", heights=[12, 25])
    (building,) = build(given).buildings
    assert not city_issues(City((building,)))


@pytest.mark.parametrize("sides", [4, 8])
def test_a_spire_has_the_height_of_the_map(sides):
    turn = 2 * np.pi * np.arange(sides) / sides + 0.3
    shape = shapely.Polygon(np.stack([50 + 4 * np.cos(turn), 50 + 4 * np.sin(turn)], axis=1))
    given = bodies(shape, roof="pyramidal", heights=[40], roof_heights=[18])
    (building,) = build(given).buildings
    assert not city_issues(City((building,)))
    z = np.concatenate([s.polygons.points[:, 2] for s in building.surfaces])
    assert z.max() - building.attributes["floorHeight"] == pytest.approx(40.0, abs=0.1)
    slopes = [s.polygons.points for s in building.surfaces if s.kind == "RoofSurface"]
    tops = [p[p[:, 2].argmax()] for p in slopes if np.ptp(p[:, 2]) > 10.0]
    assert len(tops) == sides
    assert np.ptp(tops, axis=0).max() < 0.01
    low = [s.polygons.points[:, 2].max() for s in building.surfaces if s.kind == "WallSurface"]
    assert max(low) - building.attributes["floorHeight"] == pytest.approx(22.0, abs=0.1)


def round_tower(sides):
    turn = 2 * np.pi * np.arange(sides) / sides + 0.3
    return shapely.Polygon(np.stack([50 + 4 * np.cos(turn), 50 + 4 * np.sin(turn)], axis=1))


def roof_points(building):
    """Distances from the middle and heights above the floor of all corners of the roof."""
    slopes = [s.polygons.points for s in building.surfaces if s.kind == "RoofSurface"]
    points = np.concatenate(slopes)
    away = np.hypot(*(points[:, :2] - 50.0).T)
    return away, points[:, 2] - building.attributes["floorHeight"]


@pytest.mark.parametrize("sides", [4, 8, 12])
def test_a_dome_is_an_ellipsoid_over_its_walls(sides):
    given = bodies(round_tower(sides), roof="dome", heights=[40], roof_heights=[5])
    (building,) = build(given).buildings
    assert not city_issues(City((building,)))
    away, height = roof_points(building)
    assert height.max() == pytest.approx(40.0, abs=0.05)
    np.testing.assert_allclose((away / 4.0) ** 2 + ((height - 35.0) / 5.0) ** 2, 1.0, atol=0.03)
    assert len(np.unique(np.round(height, 2))) >= 6


def test_a_dome_without_a_height_is_a_half_sphere():
    given = bodies(round_tower(12), roof="dome", heights=[40])
    (building,) = build(given).buildings
    _, height = roof_points(building)
    least = 4.0 * np.cos(np.pi / 12)  # Half the least width of the footprint.
    assert np.ptp(height) == pytest.approx(least, abs=0.1)


@pytest.mark.parametrize("sides", [4, 8])
def test_an_onion_keeps_within_its_walls_and_ends_in_a_point(sides):
    given = bodies(round_tower(sides), roof="onion", heights=[30], roof_heights=[10])
    (building,) = build(given).buildings
    assert not city_issues(City((building,)))
    away, height = roof_points(building)
    assert away.max() <= 4.001
    assert height.max() == pytest.approx(30.0, abs=0.05)
    order = np.argsort(height)
    assert (np.diff(away[order]) < 0.01).all()
    # Bulging below, hollow above.
    assert away[np.abs(height - 22.6).argmin()] > 3.5
    assert away[np.abs(height - 27.2).argmin()] < 1.0


def test_buildings_within_others_are_left_out():
    inside = shapely.box(22, 22, 26, 26)
    built = build(houses(SQUARE, inside))
    assert len(built.buildings) == 1
    assert any(issue.kind == "osm.building_inside" for issue in built.issues)


def test_the_same_map_gives_the_same_buildings():
    first, again = (build(houses(SQUARE, L_SHAPE)).buildings for _ in range(2))
    assert first == again


def parts(building):
    """What is fixed to a building: the template of each placement."""
    return Counter(part.placement.template for part in building.walk() if part.placement)


def test_an_l_has_a_ridge_over_each_arm():
    (building,) = build(houses(L_SHAPE, roof="gabled", storeys=2.0, height=9.0)).buildings
    slopes = [s for s in building.surfaces if s.kind == "RoofSurface"]
    level = [s for s in slopes if np.ptp(s.polygons.points[:, 2]) < 0.01]
    assert building.attributes["roofType"] == "1030"
    assert not level
    top = max(s.polygons.points[:, 2].max() for s in slopes)
    ridge = [p for s in slopes for p in s.polygons.points if p[2] > top - 0.01]
    low, high = np.min(ridge, axis=0), np.max(ridge, axis=0)
    # Eaves of equal height and pitch: both ridges lie in the middle of their arms of 10 m.
    assert high[0] - low[0] > 10.0 or high[1] - low[1] > 10.0
    assert min(abs(low[1] - 25.0), abs(high[0] - 55.0)) < 0.1


def test_shops_of_the_map_have_fronts_at_the_street_and_others_have_none():
    road = [[(0, 0), (200, 0), (200, 12)], [(0, 0), (200, 12), (0, 12)]]
    long = shapely.Polygon([(10, 16), (70, 16), (70, 30), (40, 31), (10, 30)])
    given = houses(long, shapely.box(80, 16, 100, 28), storeys=4.0, roof="flat", kind="apartments")
    ground = Ground(HeightMap(Chunk(0, 0), np.zeros((256, 256))))
    shops = np.array([[60.0, 18.0]])
    built = build_mapped(given, ground, np.array(road, float), RULES, 0, "map", shops).buildings
    fascias = [part.placement for b in built for part in b.walk() if part.placement]
    fascias = [each for each in fascias if each.template == "shop_fascia"]
    assert len(fascias) == 1
    assert fascias[0].position[:2] == pytest.approx([62.5, 16.0], abs=8.0)
    assert fascias[0].position[1] == pytest.approx(16.0, abs=0.2)
    doors = [
        opening.polygons.points.mean(0)
        for surface in built[0].surfaces
        for opening in surface.openings
        if opening.kind == "DoorSurface"
    ]
    # The wall of 60 m looks like four houses, each with a door; a shop has one of its own.
    assert (
        sorted(round(d[0] // 15) for d in doors if d[1] < 17.0) == [0, 1, 2, 3, 3]
        or len(doors) >= 5
    )


def test_processes_build_what_one_does():
    """Each third house is an L, each fifth is too small to be built."""
    places = [(12.0 * (n % 16), 12.0 * (n // 16)) for n in range(160)]
    shapes = [
        shapely.transform(L_SHAPE, lambda p, at=at: 0.2 * (p - 50.0) + 8.0 + at)
        if n % 3 == 0
        else shapely.box(at[0], at[1], at[0] + (8.0 if n % 5 else 0.2), at[1] + 7.0)
        for n, at in enumerate(places)
    ]
    given, ground = houses(*shapes), Ground(HeightMap(Chunk(0, 0), np.zeros((256, 256))))
    road = np.empty((0, 3, 2))
    alone = build_mapped(given, ground, road, RULES, 0, "map")
    shared = build_mapped(given, ground, road, RULES, 0, "map", executor=LocalProcesses(2))
    assert shared == alone
    assert 100 < len(alone.buildings) < 160
    assert {issue.kind for issue in alone.issues} == {"osm.building_small", "osm.building_height"}


def test_balconies_keep_clear_of_other_buildings():
    blocks = [shapely.box(x, 60, x + 18, 71) for x in (10.0, 29.3)]
    blocks = [shapely.union(b, shapely.box(b.bounds[0], 71, b.bounds[0] + 9, 75)) for b in blocks]
    for building in build(houses(*blocks, storeys=4.0, roof="flat")).buildings:
        for part in building.walk():
            if part.placement is not None and part.placement.template == "balcony":
                # It stands at its wall, half of its footprint before it.
                assert sum(footprint_of(part).intersects(block) for block in blocks) == 1


def test_flat_roofs_lie_behind_a_parapet():
    (building,) = build(houses(COURT, roof="flat", storeys=4.0, kind="apartments")).buildings
    top = max(s.polygons.points[:, 2].max() for s in building.surfaces if s.kind == "WallSurface")
    roof = [s for s in building.surfaces if s.kind == "RoofSurface"]
    level = max(roof, key=lambda s: len(s.polygons.points)).polygons.points[:, 2]
    assert 0.3 < top - level.min() < 1.0


def test_a_house_cut_by_a_bend_stays_off_the_road():
    angles = np.linspace(0.0, np.pi / 2, 13)
    arc = np.array([26.0, 25.0]) + 30.0 * np.column_stack([np.cos(angles), np.sin(angles)]) - 28.0
    road = [[(-40.0, -40.0), arc[n].tolist(), arc[n + 1].tolist()] for n in range(12)]
    (building,) = build(houses(shapely.box(15.0, 10.0, 32.0, 30.0)), road).buildings
    surface = shapely.union_all(shapely.polygons(np.array(road, float)))
    assert walls(building).distance(surface) > 0.04
    assert walls(building).area < 17 * 20
