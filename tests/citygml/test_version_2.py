"""What is written as CityGML 2.0 is valid, and what it can hold comes back."""

import numpy as np
import pytest
from lxml import etree

from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons


def square(z=0.0, size=1.0):
    ring = np.array([[0.0, 0.0, z], [size, 0.0, z], [size, size, z], [0.0, size, z]])
    return Polygons.of_rings([ring])


def house():
    window = ThematicSurface("w1", "WindowSurface", square(1.0), 3, "glass")
    facts = {"part": "wall"}
    wall = ThematicSurface("wall", "WallSurface", square(), 3, "brick_red", facts, (window,))
    porch = CityObject("porch", "BuildingInstallation", surfaces=(wall_of("p"),), solid_lod=3)
    part = CityObject("part", "BuildingPart", {"roofType": "1000"}, (wall_of("g"),), solid_lod=3)
    return CityObject(
        "house",
        "Building",
        {"function": "1000;1010", "height": 7.5, "storeysAboveGround": 2, "style": "row"},
        (wall,),
        3,
        {"lod0MultiSurface": square(), "lod1Solid": square(2.0)},
        children=(porch, part),
    )


def wall_of(name):
    return ThematicSurface(f"{name}_wall", "WallSurface", square(), 3)


def road():
    area = ThematicSurface("a", "TrafficArea", square(), 2, "asphalt", {"function": "1"})
    kerb = ThematicSurface("k", "AuxiliaryTrafficArea", square(), 2)
    mark = ThematicSurface("m", "Marking", square(), 2, "marking_white", {"class": "solid"})
    line = {"lod2MultiCurve": (np.array([[0.0, 0, 0], [5, 0, 0]]),)}
    lane = CityObject(
        "lane",
        "TrafficSpace",
        {"granularity": "lane", "opendrive_lane": -1},
        (area,),
        curves=line,
        relations={"successor": ("next",)},
    )
    side = CityObject("side", "AuxiliaryTrafficSpace", {"granularity": "lane"}, (kerb,))
    section = CityObject("s", "Section", surfaces=(mark,), children=(lane, side))
    return CityObject("road", "Road", children=(section,))


def tree():
    place = Placement(np.array([1.0, 2, 3]), 0.3, np.array([2.0, 2, 5]), "tree")
    return CityObject("t", "SolitaryVegetationObject", {"height": 5.0}, placement=place)


def test_a_whole_city_is_valid_and_comes_back(tmp_path, old_xsd):
    path = tmp_path / "city.gml"
    write_city(City((house(), road(), tree()), "EPSG:25832", (5.0, 6.0, 7.0)), path, "2.0")
    assert old_xsd.validate(etree.parse(str(path))), old_xsd.error_log
    city = read_city(path, "EPSG:25832", (5.0, 6.0, 7.0))
    found, way, plant = city.objects
    assert found.attributes["function"] == "1000;1010"
    assert found.attributes["height"] == 7.5
    assert found.attributes["style"] == "row"
    assert found.solid_lod == 3
    (wall,) = found.surfaces
    assert (wall.id, wall.material) == ("wall", "brick_red")
    (window,) = wall.openings
    assert (window.kind, window.material) == ("WindowSurface", "glass")
    np.testing.assert_array_equal(window.polygons.points, square(1.0).points)
    np.testing.assert_array_equal(found.geometry["lod1Solid"].points, square(2.0).points)
    assert {child.kind for child in found.children} == {"BuildingInstallation", "BuildingPart"}
    areas = {surface.id for part in way.walk() for surface in part.surfaces}
    assert areas == {"a", "k", "m"}
    assert plant.placement.template == "tree"
    np.testing.assert_array_equal(plant.placement.size, [2, 2, 5])
    np.testing.assert_array_equal(plant.placement.position, [1, 2, 3])


def test_an_unknown_version_is_refused(tmp_path):
    with pytest.raises(EnvgenError, match=r"choose from 3\.0, 2\.0"):
        write_city(City(()), tmp_path / "city.gml", "1.0")
    assert list(tmp_path.iterdir()) == []
