"""Buildings: closed solids, in their plots, clear of one another and of the road."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
import shapely
import trimesh

from envgen_usd.city.building import Site, make_building
from envgen_usd.city.design import draw_design
from envgen_usd.geometry.triangulate import triangulate
from envgen_usd.profiles import known_environments, read_profile
from envgen_usd.seeds import generator

ENVIRONMENTS = [
    (country, area) for country, areas in known_environments().items() for area in areas
]


def all_surfaces(building):
    return [s for wall in building.surfaces for s in (wall, *wall.openings)]


def solid_of(building):
    """The shell as a mesh; equal coordinates are one vertex."""
    corners = []
    for surface in all_surfaces(building):
        triangles, _ = triangulate(surface.polygons)
        corners.append(surface.polygons.points[triangles].reshape(-1, 3))
    vertices, index = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    return trimesh.Trimesh(vertices, index.reshape(-1, 3), process=False)


def draw(rules, number, space=(40.0, 30.0)):
    space = (9.0, 14.0) if rules.style == "row" else space
    return draw_design(rules, space, generator(0, "test", number))


def stand(design, turn=0.4, lowest=1.0, highest=1.6):
    along = np.array([np.cos(turn), np.sin(turn)])
    return make_building("b", design, Site(np.array([100.0, 50.0]), along, lowest, highest))


def expected_volume(design, base):
    """Closed form of a building without chimney, overhang and parapet."""
    width, depth = design.width, design.depth
    run = depth if design.ridge_to_street else width
    span = width if design.ridge_to_street else depth
    walls = width * depth * (design.eaves - base)
    rise = {
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


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_shells_are_closed_manifolds_that_face_outwards(country, area):
    rules = read_profile(country, area).buildings
    for number in range(40):
        design = draw(rules, number)
        mesh = solid_of(stand(design, turn=number))
        assert mesh.is_watertight, design
        assert mesh.is_winding_consistent, design
        assert mesh.volume > 0, design
        manifold = manifold3d.Manifold(
            manifold3d.Mesh(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
        )
        assert manifold.status() == manifold3d.Error.NoError, design
        assert manifold.genus() == 0


@pytest.mark.parametrize(
    ("roof", "over", "turned"),
    [
        (roof, over, turned)
        for roof in ("flat", "shed", "gabled", "hipped", "pyramidal")
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
        design = replace(design, ridge_to_street=turned and style == "detached")
        mesh = solid_of(stand(design, turn=0.0))
        base = float(mesh.bounds[0, 2]) - (1.6 + design.plinth)
        assert mesh.is_watertight
        if over == 0.0:
            assert mesh.volume == pytest.approx(expected_volume(design, base), rel=1e-3)
        else:
            assert mesh.volume > expected_volume(design, base)


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_windows_fill_holes_of_their_walls_on_a_grid(country, area):
    rules = read_profile(country, area).buildings
    design = draw(rules, 3)
    building = stand(design, turn=0.0)
    walls = [s for s in building.surfaces if s.attributes["part"] == "wall"]
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
    assert all(np.allclose(door.polygons.points[:, 1], 50.0) for door in doors)


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
    ground = next(s for s in building.surfaces if s.kind == "GroundSurface")
    return shapely.Polygon(ground.polygons.points[:, :2])


def covered(building):
    """Everything under the building, with its eaves."""
    points = np.concatenate([s.polygons.points for s in building.surfaces])
    return shapely.MultiPoint(points[:, :2]).convex_hull


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_buildings_keep_to_their_plots_and_clear_of_one_another(make_map, country, area):
    scene = make_map(country, area)
    plots = {plot.id: shapely.Polygon(plot.polygon) for plot in scene.plots}
    buildings = {b.id: b for city in scene.cities for b in city.of_kind("Building")}
    assert len(buildings) > 0.9 * len(plots)
    shapes = {name: covered(building) for name, building in buildings.items()}
    for name, shape in shapes.items():
        plot = plots[name.removeprefix("building_")]
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
