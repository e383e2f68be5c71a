"""Buildings: closed solids, in their plots, clear of one another and of the road."""

from collections import Counter
from dataclasses import replace
from itertools import combinations

import manifold3d
import numpy as np
import pytest
import shapely
import trimesh
from tests.environments import TABLE_A1

from envgen_usd.city.buildings.building_design import Bay, Chimney, Extras, Wing
from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.building_shell import build_shell
from envgen_usd.city.buildings.design_draws import draw_design
from envgen_usd.city.buildings.facades import Facade, lay_out
from envgen_usd.city.buildings.installations import balcony
from envgen_usd.city.buildings.level_of_detail import LEVELS, Modelling
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.seeds import Draws, generator


def shells(building):
    """Polygons of each solid of a building, of its parts and installations."""
    for thing in building.walk():
        if thing.solid_lod >= 0:
            yield joined([s.polygons for s in all_surfaces(thing)])
        if "lod1Solid" in thing.geometry:
            yield thing.geometry["lod1Solid"]


def all_surfaces(part):
    """Surfaces of a part and their openings."""
    return [s for wall in part.surfaces for s in (wall, *wall.openings)]


def joined(parts):
    rings = [np.diff(part.ring_offsets) for part in parts]
    polygons = [np.diff(part.polygon_offsets) for part in parts]
    return Polygons(
        np.concatenate([part.points for part in parts]),
        np.concatenate([[0], np.cumsum(np.concatenate(rings))]),
        np.concatenate([[0], np.cumsum(np.concatenate(polygons))]),
    )


def mesh_of(polygons):
    """A shell as a mesh; equal coordinates are one vertex."""
    corners = [polygons.points[triangulate(polygons)[0]].reshape(-1, 3)]
    vertices, index = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    return trimesh.Trimesh(vertices, index.reshape(-1, 3), process=False)


def manifold_of(mesh):
    return manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices, mesh.faces.astype(np.uint64)))


HIPS = ("hipped", "pyramidal")
SPACES = {"row": (9.0, 14.0), "detached": (20.0, 18.0), "hall": (40.0, 30.0)}


def draw(rules, number):
    return draw_design(rules, SPACES[rules.style], Draws(0, "test", number))


def stand(design, turn=0.4, lowest=1.0, highest=1.6, level="3.3"):
    along = np.array([np.cos(turn), np.sin(turn)])
    site = Site(np.array([100.0, 50.0]), along, lowest, highest, highest - 0.3)
    return make_building("b", design, site, Modelling(LEVELS[level]))[0]


def solid_of(building):
    return mesh_of(next(shells(building)))


def expected_volume(design, base):
    """Closed form of a building without chimney, overhang and parapet."""
    width, depth = design.width, design.depth
    run = depth if design.ridge_to_street else width
    span = width if design.ridge_to_street else depth
    walls = width * depth * (design.eaves - base)
    tooth = span / max(2, -(-span // 8))
    rise = {
        "sawtooth": span * tooth * max(design.slope, 0.25) / 2 * run,
        "flat": 0.0,
        "shed": span * span * design.slope / 2 * run,
        "gabled": span * (span / 2) * design.slope / 2 * run,
    }
    if design.roof in rise:
        return walls + rise[design.roof]
    half = min(width, depth) / 2
    height = half * design.slope
    if design.roof == "pyramidal":
        return walls + width * depth * height / 3
    ridge = max(width, depth) - 2 * half
    return walls + height * half * ridge + (2 * half) ** 2 * height / 3


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
def test_solids_are_valid_by_three_judges(country, area):
    rules = read_profile(country, area).buildings
    for number in range(25):
        design = draw(rules, number)
        for shell in shells(stand(design, turn=number)):
            assert find_faults(Bodies.of_solid(shell)) == [], design
            mesh = mesh_of(shell)
            assert mesh.is_watertight, design
            assert mesh.is_winding_consistent, design
            assert mesh.volume > 0, design
            assert manifold_of(mesh).status() == manifold3d.Error.NoError, design


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
def test_separate_solids_of_a_building_have_a_joint_and_no_common_volume(country, area):
    """Solids that touch on a wall overlap by up to 1 mm once coordinates lie on the grid."""
    rules = read_profile(country, area).buildings
    rules = replace(rules, details=replace(rules.details, garages=0.5, porches=0.7))
    installations = 0
    for number in range(25):
        building = stand(draw(rules, number), turn=number)
        house, *parts = (
            (part.kind, manifold_of(mesh_of(joined([s.polygons for s in all_surfaces(part)]))))
            for part in building.walk()
            if part.placement is None
        )
        for (kind, one), (_, other) in combinations([*parts, house], 2):
            assert one.min_gap(other, 0.1) > 1e-3, (number, kind)
        for kind, body in parts:
            if kind == "BuildingInstallation":
                assert body.min_gap(house[1], 0.1) < 5e-3, number
                installations += 1
    assert installations or rules.style == "hall"


@pytest.mark.parametrize("number", [428, 1679])
def test_a_chimney_near_a_valley_leaves_no_sliver(number):
    """Its foot cuts the valley into pieces of centimetres, which the grid of 1 mm tilted."""
    rules = read_profile("1", "residential").buildings
    design = draw_design(rules, SPACES["row"], Draws(0, "f", number))
    assert design.extras.wings
    assert design.chimney is not None
    for shell in shells(stand(design, turn=number)):
        assert find_faults(Bodies.of_solid(shell)) == []


@pytest.mark.parametrize("level", list(LEVELS))
def test_every_level_of_detail_is_valid(level):
    rules = read_profile("2", "residential").buildings
    for number in range(12):
        building = stand(draw(rules, number), turn=number, level=level)
        for shell in shells(building):
            assert find_faults(Bodies.of_solid(shell)) == []
        lod = LEVELS[level].lod
        assert {s.lod for s in building.surfaces} == ({lod} if lod > 1 else set())
        assert ("lod1Solid" in building.geometry) == (lod > 0)
        assert "lod0MultiSurface" in building.geometry or lod == 1


def test_finer_levels_have_what_coarser_ones_lack():
    rules = read_profile("2", "residential").buildings
    found = {name: [0, 0, 0, 0] for name in LEVELS}
    for number in range(40):
        design = draw(rules, number)
        for name in LEVELS:
            building = stand(design, level=name)
            openings = [o for part in building.walk() for s in part.surfaces for o in s.openings]
            parts = [s.attributes.get("part") for s in building.surfaces]
            found[name][0] += parts.count("dormer") + parts.count("chimney")
            found[name][1] += parts.count("soffit")
            found[name][2] += len(openings)
            found[name][3] += sum(part.kind == "BuildingInstallation" for part in building.walk())
    assert found["2.1"][:2] == [0, 0]
    assert found["2.2"][0] > 0
    assert found["2.2"][1] == 0
    assert found["2.3"][1] > 0
    assert found["2.3"][2] == 0
    assert 0 < found["3.0"][2] < found["3.1"][2] < found["3.2"][2] == found["3.3"][2]
    assert found["3.2"][3] == 0 < found["3.3"][3]


@pytest.mark.parametrize(
    ("roof", "over", "turned"),
    [
        (roof, over, turned)
        for roof in ("flat", "shed", "gabled", "hipped", "pyramidal", "sawtooth")
        for over in (0.0, 0.4)
        for turned in (False, True)
    ],
)
def test_volumes_are_those_of_closed_forms(roof, over, turned):
    rules = read_profile("2", "residential").buildings
    for style in ("detached", "row"):
        design = replace(
            draw(rules, 1), style=style, roof=roof, chimney=None, overhang=over, parapet=0.0
        )
        design = replace(design, ridge_to_street=turned and style == "detached", extras=Extras())
        mesh = solid_of(stand(design, turn=0.0))
        base = float(mesh.bounds[0, 2]) - (1.6 + design.plinth)
        assert mesh.is_watertight
        # At a party wall only an extruded roof stands over.
        if over == 0.0 or roof == "sawtooth" or (style == "row" and roof in HIPS):
            assert mesh.volume == pytest.approx(expected_volume(design, base), rel=1e-3)
        else:
            assert mesh.volume > expected_volume(design, base)


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
def test_windows_fill_holes_of_their_walls_on_a_grid(country, area):
    rules = read_profile(country, area).buildings
    # All walls of a rectangle look away from its middle; openings without embrasures fill holes.
    details = replace(rules.details, footprints={"rectangle": 1.0}, embrasure=(0.0, 0.0))
    design = draw(replace(rules, details=details), 3)
    building = stand(design, turn=0.0)
    walls = [s for s in building.surfaces if s.attributes["part"] in ("wall", "dormer")]
    assert sum(len(wall.openings) for wall in walls) > 0
    floor = building.attributes["floorHeight"]
    for wall in walls:
        exterior, *holes = wall.polygons.rings(0)
        rings = [opening.polygons.rings(0)[0] for opening in wall.openings]
        assert {frozenset(map(tuple, h)) for h in holes} == {
            frozenset(map(tuple, r)) for r in rings
        }
        for opening, ring in zip(wall.openings, rings, strict=True):
            # Lower left corner first, seen from outside.
            right, up = ring[1] - ring[0], ring[3] - ring[0]
            assert right[2] == 0.0
            assert up[2] > 0.0
            outward = np.cross(right, up)
            middle = building_middle(building)
            assert outward @ (ring.mean(axis=0) - middle) > 0.0
            storey = (ring[0, 2] - floor) // design.storey_height
            if opening.kind == "WindowSurface":
                assert ring[2, 2] <= floor + (storey + 1) * design.storey_height
        columns = {
            round(float(np.linalg.norm(ring[:2, :2].mean(axis=0) - exterior[0, :2])), 2)
            for opening, ring in zip(wall.openings, rings, strict=True)
            if opening.kind == "WindowSurface"
        }
        windows = sum(opening.kind == "WindowSurface" for opening in wall.openings)
        assert windows <= len(columns) * design.storeys
    doors = [o for wall in walls for o in wall.openings if o.kind == "DoorSurface"]
    assert doors
    # The street wall runs along y = 50.
    wall = 50.0 + design.main_front
    assert all(np.allclose(door.polygons.points[:, 1], wall) for door in doors)


def building_middle(building):
    points = np.concatenate([surface.polygons.points for surface in building.surfaces])
    return (points.min(axis=0) + points.max(axis=0)) / 2


def test_foundations_reach_below_the_lowest_and_floors_lie_above_the_highest_ground():
    design = draw(read_profile("2", "residential").buildings, 5)
    building = stand(design, lowest=-3.0, highest=2.0)
    points = np.concatenate([surface.polygons.points for surface in building.surfaces])
    assert points[:, 2].min() < -3.0
    assert building.attributes["floorHeight"] > 2.0
    doors = [o for s in building.surfaces for o in s.openings if o.kind == "DoorSurface"]
    assert min(door.polygons.points[:, 2].min() for door in doors) > 2.0


def footprint(building):
    grounds = [s.polygons.points for s in building.surfaces if s.kind == "GroundSurface"]
    return shapely.MultiPoint(np.concatenate(grounds)[:, :2]).convex_hull


def covered(building):
    """Everything under the building, with its eaves."""
    parts = [s.polygons.points for part in building.walk() for s in part.surfaces]
    return shapely.MultiPoint(np.concatenate(parts)[:, :2]).convex_hull


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
def test_buildings_keep_to_their_plots_and_clear_of_one_another(make_map, country, area):
    scene = make_map(country, area)
    plots = {plot.id: shapely.Polygon(plot.polygon) for plot in scene.plots}
    buildings = {b.id: b for city in scene.cities for b in city.of_kind("Building")}
    assert len(buildings) > 0.9 * len(plots)
    shapes = {name: covered(building) for name, building in buildings.items()}
    for name, shape in shapes.items():
        plot = plots[name.removeprefix("building_").removesuffix("_back")]
        assert shape.difference(plot).area < 1e-9
        assert shape.intersection(shapely.box(0, 94.5, 400, 103.62)).area == 0.0
    tree = shapely.STRtree(list(shapes.values()))
    one, _ = tree.query(list(shapes.values()), predicate="overlaps")
    assert len(one) == 0


def test_overlapping_plots_carry_one_building(make_map):
    scene = make_map("2", "residential", doubled=True)
    buildings = [b for city in scene.cities for b in city.of_kind("Building")]
    shapes = [covered(building) for building in buildings]
    one, two = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    assert (one == two).all()
    assert len(buildings) > 0.9 * len(scene.plots) / 2


def plain(**changes):
    """A detached gabled house of 12 m by 10 m with two storeys of 3 m."""
    rules = read_profile("2", "residential").buildings
    base = {"width": 12.0, "depth": 10.0, "storeys": 2, "storey_height": 3.0, "roof": "gabled"}
    base |= {"slope": 0.8, "overhang": 0.0, "parapet": 0.0, "chimney": None, "plinth": 0.1}
    base |= {"ridge_to_street": False, "extras": Extras()}
    return replace(draw(rules, 1), **{**base, **changes})


@pytest.mark.parametrize("to_street", [False, True])
@pytest.mark.parametrize("roof", ["flat", "shed", "gabled", "hipped", "pyramidal"])
def test_the_block_of_lod1_ends_between_the_eaves_and_the_ridge_of_the_roof(roof, to_street):
    design = plain(roof=roof, ridge_to_street=to_street, parapet=0.4 * (roof == "flat"))
    site = Site(np.array([100.0, 50.0]), np.array([1.0, 0.0]), 1.0, 1.0)
    tops = []
    for share in (0.0, 0.25, 1.0):
        house, _ = make_building("b", design, site, Modelling(LEVELS["2.3"], lod1_top=share))
        tops.append(house.geometry["lod1Solid"].points[:, 2].max())
    ridge = max(s.polygons.points[:, 2].max() for s in house.surfaces)
    eaves = 1.0 + 0.1 + 2 * 3.0
    assert ridge > eaves
    assert tops == pytest.approx([eaves, eaves + 0.25 * (ridge - eaves), ridge], abs=2e-3)


def test_an_l_is_the_union_of_two_houses():
    wing = Wing(left=0.0, width=4.0, depth=4.0, storeys=2)
    house = stand(plain(depth=14.0, extras=Extras(wings=(wing,))), turn=0.0, highest=1.0)
    below = 0.5 + 0.1
    main = 12.0 * 10.0 * (6.0 + below) + 12.0 * 10.0 * 4.0 / 2
    # The wing's roof goes on until it meets the slope of the main roof: a slanted prism.
    rise = 4.0 / 2 * 0.8
    beside = 4.0 * 4.0 * (6.0 + below) + 4.0 * rise / 2 * 4.0
    valley = 4.0 * rise / 2 * (rise / 0.8) / 3
    assert solid_of(house).volume == pytest.approx(main + beside + valley, rel=1e-3)


@pytest.mark.parametrize("length", [6.0, 12.0, 31.0])
@pytest.mark.parametrize(("country", "area"), TABLE_A1)
def test_openings_of_a_wall_have_the_widths_of_the_design_and_keep_apart(country, area, length):
    design = draw(read_profile(country, area).buildings, 2)
    holes = lay_out(design, Facade(length, design.storeys, street=True))
    widths = {"DoorSurface": design.doors.width, "WindowSurface": design.windows.width}
    assert {"DoorSurface"} <= {hole.kind for hole in holes}
    for hole in holes:
        left, bottom, right, top = hole.box
        if not hole.shop:
            assert right - left == pytest.approx(min(widths[hole.kind], length - 0.7))
        assert left >= 0.35 - 1e-9
        assert right <= length - 0.35 + 1e-9
        assert 0.0 <= bottom < top < design.storeys * design.storey_height
    boxes = [shapely.box(*hole.box) for hole in holes]
    first, second = shapely.STRtree(boxes).query(boxes, "dwithin", 0.35 - 1e-9)
    assert (first == second).all()


@pytest.mark.parametrize("storeys", [1, 2, 5])
def test_windows_stand_alike_in_all_storeys_of_a_wall(storeys):
    design = plain(storeys=storeys)
    holes = lay_out(design, Facade(12.0, storeys))
    assert {hole.kind for hole in holes} == {"WindowSurface"}
    boxes = np.array([hole.box for hole in holes]).reshape(storeys, -1, 4)
    assert boxes.shape[1] >= 2
    lift = design.storey_height * np.arange(storeys)[:, None, None] * (0, 1, 0, 1)
    np.testing.assert_allclose(boxes, boxes[:1] + lift)
    assert (boxes[0, :, 1] == design.windows.sill).all()
    assert (boxes[0, :, 3] <= design.windows.sill + design.windows.height + 1e-9).all()


def test_a_door_stands_beside_what_takes_the_wall():
    design = plain()
    for start, end in ((-1.0, 7.0), (5.0, 13.0), (3.0, 9.0)):
        holes = lay_out(design, Facade(12.0, 2, street=True, taken=((start, end),)))
        doors = [hole.box for hole in holes if hole.kind == "DoorSurface"]
        assert len(doors) == 1
        assert doors[0][2] <= start or doors[0][0] >= end


def test_a_bay_and_dormers_add_volume_and_openings():
    without = stand(plain())
    for extras in (Extras(bay=Bay(2.0, 0.8, 1)), Extras(dormers=2)):
        house = stand(plain(extras=extras))
        assert solid_of(house).volume > solid_of(without).volume
        assert solid_of(house).is_watertight
        parts = {s.attributes["part"] for s in house.surfaces}
        assert ("dormer" in parts) == bool(extras.dormers)


@pytest.mark.parametrize("across", [0.0, 1.0])
@pytest.mark.parametrize("along", [0.0, 0.5, 1.0])
def test_a_chimney_stands_near_the_ridge_with_roof_all_around_it(along, across):
    design = plain(chimney=Chimney(along, across, width=0.6, height=0.9))
    house = stand(design, turn=0.0, highest=1.0)
    sides = [s.polygons.points for s in house.surfaces if s.attributes["part"] == "chimney"]
    points = np.concatenate(sides)
    low, high = points.min(axis=0), points.max(axis=0)
    np.testing.assert_allclose((high - low)[:2], 0.6, atol=2e-3)
    # The house of 12 m by 10 m has its ridge 5 m behind its front, 7.1 m + 4 m high.
    assert high[2] == pytest.approx(7.1 + 4.0 + 0.9, abs=2e-3)
    assert low[0] == pytest.approx(100.0 + 0.15 + along * (12.0 - 2 * 0.15 - 0.6), abs=2e-3)
    front = 50.0 + design.main_front
    behind_ridge = low[1] - (front + 5.0)
    assert 0.15 - 2e-3 <= behind_ridge <= 0.5 * 5.0
    assert (behind_ridge > 0.2) == bool(across)


def test_embrasures_move_the_panes_into_the_wall():
    flush, deep = stand(plain(), turn=0.0), stand(plain(extras=Extras(embrasure=0.15)), turn=0.0)
    depths = []
    for house in (flush, deep):
        front = [s for s in house.surfaces if s.openings and np.ptp(s.polygons.points[:, 1]) == 0]
        wall = min(front, key=lambda s: s.polygons.points[0, 1])
        depths.append(
            {round(o.polygons.points[0, 1] - wall.polygons.points[0, 1], 3) for o in wall.openings}
        )
    assert depths == [{0.0}, {0.15}]
    removed = sum(
        np.ptp(o.polygons.points[:, 2]) * np.ptp(o.polygons.points[:, :2], axis=0).max() * 0.15
        for s in flush.surfaces
        for o in s.openings
    )
    assert solid_of(deep).volume == pytest.approx(solid_of(flush).volume - removed, rel=1e-4)
    assert solid_of(deep).is_watertight


def test_a_garage_is_a_part_that_touches_nothing():
    house = stand(plain(extras=Extras(garage=3.0)))
    (garage,) = house.children[-1:]
    assert garage.kind == "BuildingPart"
    assert garage.solid_lod == 3
    one = shapely.MultiPoint(np.concatenate([s.polygons.points for s in house.surfaces])[:, :2])
    two = shapely.MultiPoint(np.concatenate([s.polygons.points for s in garage.surfaces])[:, :2])
    assert 0.0 < one.convex_hull.distance(two.convex_hull) < 0.01
    hidden = [
        o
        for s in house.surfaces
        for o in s.openings
        if two.convex_hull.distance(shapely.MultiPoint(o.polygons.points[:, :2])) < 0.05
    ]
    assert all(o.polygons.points[:, 2].min() > 2.5 for o in hidden)


def test_rooms_lie_inside_the_house():
    wing = Wing(left=0.0, width=4.0, depth=4.0, storeys=1)
    design = plain(depth=14.0, extras=Extras(wings=(wing,)))
    site = Site(np.array([100.0, 50.0]), np.array([1.0, 0.0]), 1.0, 1.0)
    house, _ = make_building("b", design, site, Modelling(rooms=True))
    rooms = [part for part in house.walk() if part.kind == "BuildingRoom"]
    assert len(rooms) == 3
    shell = solid_of(house)
    for room in rooms:
        mesh = mesh_of(joined([s.polygons for s in room.surfaces]))
        assert mesh.is_watertight
        assert (manifold_of(shell) ^ manifold_of(mesh)).volume() == pytest.approx(mesh.volume)
    heights = {round(float(np.ptp(s.polygons.points[:, 2])), 3) for r in rooms for s in r.surfaces}
    assert heights == {0.0, 2.75}


@pytest.mark.parametrize("out", [-1, 1])
def test_a_balcony_is_a_slab_with_a_balustrade_on_three_sides(out):
    faces = balcony(2.0, 5.5, 10.0, 3.0, out)
    mesh = mesh_of(Polygons.of_rings([np.array(face.ring) for face in faces]))
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    width, depth, height = np.ptp(mesh.bounds, axis=0)
    assert width == pytest.approx(3.5)
    assert mesh.bounds[0 if out > 0 else 1, 1] == pytest.approx(10.0)
    # The floor is what the balustrade leaves free.
    (floor,) = [np.array(face.ring) for face in faces if face.kind == "OuterFloorSurface"]
    assert (floor[:, 2] == 3.0).all()
    room, free = np.ptp(floor[:, :2], axis=0)
    thick = (width - room) / 2
    assert free == pytest.approx(depth - thick)
    rail = mesh.bounds[1, 2] - 3.0
    assert mesh.volume == pytest.approx(width * depth * height - room * free * rail)


def test_steps_lead_from_the_ground_to_the_door():
    house = stand(plain(plinth=0.5), turn=0.0, highest=1.0)
    steps = next(part for part in house.children if "_steps_" in part.id)
    treads = sorted(
        {float(s.polygons.points[0, 2]) for s in steps.surfaces if s.kind == "OuterFloorSurface"}
    )
    assert treads[-1] == pytest.approx(1.5)
    rises = np.diff([0.7, *treads])
    assert rises.max() <= 0.181
    np.testing.assert_allclose(rises, rises[0], atol=0.002)


def test_nothing_of_a_house_of_a_row_stands_out_to_its_sides():
    rules = read_profile("1", "residential").buildings
    for number in range(60):
        design = draw_design(rules, (6.2, 14.0), Draws(0, "test", number))
        house = stand(replace(design, extras=replace(design.extras, porch=True)), turn=0.0)
        points = [s.polygons.points for part in house.walk() for s in part.surfaces]
        x = np.concatenate(points)[:, 0] - 100.0
        assert x.min() >= 0.0
        assert x.max() <= design.width + 1e-9


def test_rows_of_houses_have_blank_party_walls():
    rules = read_profile("1", "residential").buildings
    for number in range(20):
        house = stand(draw(rules, number), turn=0.0)
        points = np.concatenate([s.polygons.points for s in house.surfaces])
        sides = points[:, 0].min(), points[:, 0].max()
        for surface in house.surfaces:
            if np.ptp(surface.polygons.points[:, 0]) == 0.0:
                assert not surface.openings or surface.polygons.points[0, 0] not in sides


@pytest.mark.parametrize("number", range(12))
def test_an_open_side_wall_of_a_row_house_has_windows_and_keeps_the_shell_closed(number):
    rules = read_profile("1", "residential").buildings
    design = replace(draw(rules, number), gables=(True, False))
    house = stand(design, turn=0.0)
    for shell in shells(house):
        assert find_faults(Bodies.of_solid(shell)) == [], design
        assert mesh_of(shell).is_watertight, design
    points = np.concatenate([s.polygons.points for s in house.surfaces])
    right, left = points[:, 0].max(), points[:, 0].min()
    found = {right: [], left: []}
    for surface in house.surfaces:
        x = surface.polygons.points[:, 0]
        if surface.kind == "WallSurface" and np.ptp(x) == 0.0 and x[0] in found:
            found[x[0]] += surface.openings
    assert not found[left]
    assert {opening.kind for opening in found[right]} == {"WindowSurface"}
    # Windows stand alike in all storeys.
    assert len(found[right]) % design.storeys == 0


def seen(shell, wanted):
    """Whether all of each part that a design has is in the faces of its shell."""
    faces, extras = shell.faces, wanted.extras
    area = sum(
        shapely.Polygon(np.array(f.ring)[:, :2], [np.array(h)[:, :2] for h in f.holes]).area
        for f in faces
        if f.kind == "GroundSurface"
    )
    bay = extras.bay.width * extras.bay.depth if extras.bay else 0.0
    main = wanted.width * wanted.main_depth + sum(w.width * w.depth for w in extras.wings)
    narrower = 0.16 * sum(wing.depth for wing in extras.wings)
    windows = [o for f in faces for o in f.openings if f.kind == "RoofSurface"]
    stands_over = wanted.overhang > 0 and wanted.roof not in {"sawtooth", "barrel", "mansard"}
    stands_over &= not (wanted.style == "row" and wanted.roof in {"hipped", "pyramidal"})
    front = min(p[1] for f in faces if f.kind == "GroundSurface" for p in f.ring)
    return {
        "wings": not extras.wings or abs(area - bay * (front < -0.1) - main) < narrower,
        "bay": not bay or front < -0.1,
        "dormers": extras.dormers * 2 == dormer_count(faces),
        "roof_windows": len(windows) == 2 * extras.roof_windows,
        "chimney": not wanted.chimney or any(f.part == "chimney" for f in faces),
        "overhang": not stands_over or any(f.kind == "OuterCeilingSurface" for f in faces),
    }


def dormer_count(faces):
    """Groups of faces that share places and have a window: a wing may cover that of a dormer."""
    shapes, windows = [], []
    for face in (f for f in faces if f.part == "dormer"):
        plan = np.array(face.ring)[:, :2]
        shapes.append(shapely.box(*plan.min(axis=0), *plan.max(axis=0)).buffer(0.01))
        windows += [shapely.Point(plan.mean(axis=0)) for _ in face.openings]
    groups = shapely.get_parts(shapely.union_all(shapes)) if shapes else []
    return sum(any(group.intersects(window) for window in windows) for group in groups)


@pytest.mark.parametrize("environment", TABLE_A1, ids=" ".join)
def test_a_shell_says_what_it_has_not(environment):
    """What is missing in the faces, and nothing else, is named."""
    rules = read_profile(*environment).buildings
    lost = Counter()
    for number in range(120):
        space = generator(0, "space", number).uniform((6, 8), (20, 18))
        wanted = draw_design(rules, tuple(space), Draws(0, "test", number))
        shell = build_shell(wanted, -1.0)
        missing = {part for part, there in seen(shell, wanted).items() if not there}
        assert set(shell.left_out) == missing, number
        lost.update(missing)
    assert lost or rules.style == "hall"


def test_a_garage_leaves_the_house_its_room_beside_it():
    rules = read_profile("2", "residential").buildings
    rules = replace(rules, details=replace(rules.details, garages=1.0))
    for width in (12.0, 16.0, 20.0, 26.0):
        for number in range(15):
            design = draw_design(rules, (width, 18.0), Draws(generator(0, "test", number)))
            assert design.width + design.extras.garage <= width + 1e-9


def test_slopes_that_shall_have_roof_windows_have_one_or_two_each():
    rules = read_profile("2", "residential").buildings
    rules = replace(rules, details=replace(rules.details, roof_windows=1.0, dormers=0.0))
    designs = [draw(rules, number) for number in range(60)]
    counts = [each.extras.roof_windows for each in designs if each.roof in ("gabled", "hipped")]
    # Low roofs have no attic, and so none.
    assert set(counts) - {0} == {1, 2}
    assert 0.3 < np.mean([count == 1 for count in counts if count]) < 0.7


def test_hardly_any_house_loses_a_part_that_was_drawn():
    rules = read_profile("2", "residential").buildings
    designs = [draw(rules, number) for number in range(300)]
    winged = [design for design in designs if design.extras.wings or design.extras.dormers]
    lost = 0
    for design in winged:
        built = build_shell(design, -1.0).design.extras
        wanted = design.extras
        lost += (len(built.wings), built.dormers) != (len(wanted.wings), wanted.dormers)
    assert len(winged) > 100
    assert lost <= 0.04 * len(winged)
