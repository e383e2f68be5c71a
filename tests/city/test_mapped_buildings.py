"""Buildings of a map: closed solids over their footprints, with the map's figures."""

from itertools import pairwise

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.mapped_buildings import build_mapped
from envgen_usd.environment_files import read_profile
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


def build(given, road=(), slope=0.0):
    across = np.linspace(0.0, 200.0, 256)
    ground = Ground(HeightMap(Chunk(0, 0), np.tile(slope * across, (256, 1))))
    return build_mapped(given, ground, np.array(road, float).reshape(-1, 3, 2), RULES, 0, "map")


def walls(building):
    """The area that the building's ground surface covers in plan."""
    (ground,) = [s for s in building.surfaces if s.kind == "GroundSurface"]
    starts = ground.polygons.ring_offsets
    rings = [ground.polygons.points[a:b, :2] for a, b in pairwise(starts)]
    return shapely.make_valid(shapely.Polygon(rings[0], rings[1:]))


@pytest.mark.parametrize("roof", ["flat", "hipped", "gabled"])
@pytest.mark.parametrize("shape", [SQUARE, L_SHAPE, COURT], ids=["square", "l", "court"])
def test_buildings_are_closed_solids_on_their_footprints(shape, roof):
    (building,) = build(houses(shape, roof=roof), slope=0.05).buildings
    assert not city_issues(City((building,)))
    plan = walls(building)
    assert shapely.hausdorff_distance(plan.exterior, shape.exterior) < 0.01
    assert plan.area == pytest.approx(shape.area, rel=1e-3)
    # Eaves, gutters and steps stay near the walls.
    outline = shapely.Polygon(shape.exterior)
    assert shapely.buffer(outline, 0.7).covers(footprint_of(building))


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


def test_buildings_within_others_are_left_out():
    inside = shapely.box(22, 22, 26, 26)
    built = build(houses(SQUARE, inside))
    assert len(built.buildings) == 1
    assert any(issue.kind == "osm.building_inside" for issue in built.issues)


def test_the_same_map_gives_the_same_buildings():
    first, again = (build(houses(SQUARE, L_SHAPE)).buildings for _ in range(2))
    assert first == again
