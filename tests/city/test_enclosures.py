"""Hedges, fences, walls and street furniture."""

import numpy as np
import pytest
import shapely
import trimesh

from envgen_usd.city.strips import as_polygons, post_body, strip_body
from envgen_usd.geometry.triangulate import triangulate


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
        if thing.attributes.get("template") in ("hedge", "fence", "wall")
    ]
    assert {thing.kind for thing in found} == {"PlantCover", "CityFurniture"}
    houses = {b.id: b for city in scene.cities for b in city.of_kind("Building")}
    for thing in found:
        kind, plot = thing.id.split("_", 1)
        polygons = thing.geometry["lod2MultiSurface"]
        assert mesh_of(polygons).is_winding_consistent
        shape = shapely.MultiPoint(polygons.points[:, :2])
        assert plots[plot].buffer(0.01).covers(shape)
        house = houses[f"building_{plot}"]
        walls = [s.polygons.points[:, :2] for s in house.surfaces if s.kind == "GroundSurface"]
        assert shapely.MultiPoint(np.concatenate(walls)).convex_hull.distance(shape) > 0.05
        doors = [o for s in house.surfaces for o in s.openings if o.kind == "DoorSurface"]
        for door in doors:
            middle = door.polygons.points[:, :2].mean(axis=0)
            across = np.array([0.0, 3.0 if "_r" in plot else -3.0])
            way = shapely.LineString([middle, middle + across])
            pieces = shapely.polygons([ring[:, :2] for ring in rings_of(polygons) if flat(ring)])
            assert not shapely.intersects(way, pieces).any()
        assert kind in ("hedge", "fence", "wall")


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
        if thing.placement is not None and thing.placement.template != "street_light"
    ]
    assert {"bench", "bin", "bollard", "hydrant"} >= {t.placement.template for t in found}
    assert len(found) >= 6
    for thing in found:
        x, y, z = thing.placement.position
        # The sidewalk lies between y = 94.5 and 96.5, its kerb at 96.5; the fixture has no rise.
        assert 94.6 < y < 96.4
        assert z == 0.0
        assert 0.0 < x < 400.0
        assert np.sin(thing.placement.heading) == pytest.approx(1.0)
        assert (y < 95.5) == (thing.placement.template in ("bench", "bin"))
    assert len({thing.id for thing in found}) == len(found)
