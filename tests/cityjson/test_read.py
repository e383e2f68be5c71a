"""Files that other programs wrote, made after the specification of CityJSON."""

import json

import numpy as np
import pyproj
import pytest

from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.flat_arrays import join
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.models.city_model import City, CityObject, Placement

CUBE = [[x, y, z] for z in (0, 1000) for y in (0, 1000) for x in (0, 1000)]
FACES = [
    [[0, 2, 3, 1]],
    [[4, 5, 7, 6]],
    [[0, 1, 5, 4]],
    [[1, 3, 7, 5]],
    [[3, 2, 6, 7]],
    [[2, 0, 4, 6]],
]


@pytest.fixture
def read(tmp_path):
    def read_file(objects, version="1.1", vertices=None, **more):
        file = {
            "type": "CityJSON",
            "version": version,
            "transform": {"scale": [0.01, 0.01, 0.01], "translate": [85000.0, 447000.0, -3.0]},
            "CityObjects": objects,
            "vertices": CUBE if vertices is None else vertices,
            **more,
        }
        (tmp_path / "city.json").write_text(json.dumps(file))
        return read_cityjson(tmp_path / "city.json")

    return read_file


def test_a_solid_without_semantics(read):
    city = read(
        {
            "b": {
                "type": "Building",
                "geometry": [{"type": "Solid", "lod": "1.2", "boundaries": [FACES]}],
            }
        },
        metadata={"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/28992"},
    )

    (building,) = city.objects
    solid = building.geometry["lod1Solid"]
    assert (city.crs, city.offset) == ("EPSG:28992", (85000.0, 447000.0, -3.0))
    assert solid.points.max(axis=0).tolist() == [10, 10, 10]
    assert find_faults(Bodies.of_solid(solid)) == []


def test_semantics_of_which_some_are_null_and_a_material_for_all(read):
    geometry = {
        "type": "Solid",
        "lod": "2.2",
        "boundaries": [FACES],
        "semantics": {
            "surfaces": [{"type": "GroundSurface"}, {"type": "RoofSurface", "slope": 0.5}],
            "values": [[0, 1, None, None, None, None]],
        },
        "material": {"summer": {"value": 0}},
    }

    (building,) = read(
        {"b": {"type": "Building", "geometry": [geometry]}},
        appearance={"materials": [{"name": "brick"}]},
    ).objects

    ground, roof = building.surfaces
    assert (ground.kind, ground.lod, ground.material) == ("GroundSurface", 2, "brick")
    assert (roof.kind, roof.attributes) == ("RoofSurface", {"slope": 0.5})
    whole = building.geometry["lod2Solid"]
    assert (len(whole), find_faults(Bodies.of_solid(whole))) == (6, [])
    assert ground.id != roof.id


def test_children_of_children_and_a_null_attribute(read):
    (building,) = read(
        {
            "room": {"type": "BuildingRoom", "parents": ["part"]},
            "part": {"type": "BuildingPart", "parents": ["b"], "children": ["room"]},
            "b": {
                "type": "Building",
                "children": ["part"],
                "attributes": {"age": None, "use": ["a", "b"], "storeys": 2},
            },
        }
    ).objects

    assert [part.kind for part in building.walk()] == ["Building", "BuildingPart", "BuildingRoom"]
    assert building.attributes == {"age": None, "use": ("a", "b"), "storeys": 2}


def test_a_template_that_is_not_a_box_of_one_metre(read):
    """A tree of 2 m by 2 m by 6 m with its foot at (5, 5, 0); turned by a quarter, twice as big."""
    corners = [[x, y, z] for z in (0, 6) for y in (4, 6) for x in (4, 6)]
    matrix = [0, -2, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]

    (tree,) = read(
        {
            "t": {
                "type": "SolitaryVegetationObject",
                "geometry": [
                    {
                        "type": "GeometryInstance",
                        "template": 0,
                        "boundaries": [7],
                        "transformationMatrix": matrix,
                    }
                ],
            }
        },
        **{
            "geometry-templates": {
                "templates": [{"type": "MultiSurface", "lod": "2", "boundaries": FACES}],
                "vertices-templates": corners,
            }
        },
    ).objects

    assert tree.placement.template == "tree"
    assert tree.placement.size.tolist() == pytest.approx([4, 4, 12])
    assert tree.placement.position.tolist() == [10 - 10, 10 + 10, 10]
    assert tree.placement.heading == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("side", [2, -2], ids=["turned", "mirrored"])
def test_templates_of_buildings_become_their_geometry(read, side):
    """A block of 2 m by 2 m by 6 m, twice as big; with semantics in the template."""
    corners = [[x, y, z] for z in (0, 6) for y in (4, 6) for x in (4, 6)]
    semantics = {
        "surfaces": [{"type": "GroundSurface"}, {"type": "RoofSurface"}, {"type": "WallSurface"}],
        "values": [[0, 1, 2, 2, 2, 2]],
    }
    instance = {
        "type": "GeometryInstance",
        "template": 0,
        "boundaries": [7],
        "transformationMatrix": [0, -side, 0, 1, 2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1],
    }
    (building,) = read(
        {"b": {"type": "Building", "geometry": [instance]}},
        **{
            "geometry-templates": {
                "templates": [
                    {"type": "Solid", "lod": "2", "boundaries": [FACES], "semantics": semantics}
                ],
                "vertices-templates": corners,
            }
        },
    ).objects

    assert building.placement is None
    assert [(s.kind, len(s.polygons)) for s in building.surfaces] == [
        *(("GroundSurface", 1), ("RoofSurface", 1), ("WallSurface", 4))
    ]
    shell = join([surface.polygons for surface in building.surfaces])
    left = 11 - 12 if side > 0 else 11 + 8
    assert shell.points.min(axis=0).tolist() == [left, 18, 10]
    assert shell.points.max(axis=0).tolist() == [left + 4, 22, 22]
    assert find_faults(Bodies.of_solid(shell)) == []


def test_version_1_0_without_a_transform(tmp_path):
    path = tmp_path / "old.json"
    path.write_text(
        json.dumps(
            {
                "type": "CityJSON",
                "version": "1.0",
                "metadata": {"referenceSystem": "urn:ogc:def:crs:EPSG::7415"},
                "CityObjects": {
                    "w": {
                        "type": "WaterBody",
                        "geometry": [{"type": "MultiSurface", "lod": 1.0, "boundaries": FACES[:1]}],
                    }
                },
                "vertices": [[value / 1000 for value in place] for place in CUBE],
            }
        )
    )

    city = read_cityjson(path)

    assert city.crs == "EPSG:7415"
    assert city.objects[0].geometry["lod1MultiSurface"].points.max() == 1


def test_instances_written_by_us_can_be_read_without_their_attributes(tmp_path):
    placement = Placement(np.array([1.0, 2, 3]), 0.5, np.array([2.0, 3, 4]), "tree", 0.25, -0.75)
    path = tmp_path / "city.json"
    write_cityjson(City((CityObject("t", "SolitaryVegetationObject", placement=placement),)), path)
    file = json.loads(path.read_text())
    del file["CityObjects"]["t"]["attributes"]
    path.write_text(json.dumps(file))

    found = read_cityjson(path).objects[0].placement

    assert found.position.tolist() == [1, 2, 3]
    assert found.size.tolist() == pytest.approx([2, 3, 4])
    assert (found.heading, found.pitch, found.roll) == pytest.approx((0.5, 0.25, -0.75))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ("[]", "not CityJSON"),
        ('{"type": "FeatureCollection"}', "not CityJSON"),
        ('{"type": "CityJSON", "version": "0.9"}', "is not supported"),
        ('{"type": "CityJSON", "version": "2.0"}', "does not follow CityJSON: KeyError"),
        (
            '{"type": "CityJSON", "version": "2.0", "vertices": [], "CityObjects": {"a": '
            '{"type": "Building", "geometry": [{"type": "MultiSurface", "lod": "1", '
            '"boundaries": [[[0, 1, 2]]]}]}}}',
            "does not follow CityJSON: IndexError",
        ),
        (
            '{"type": "CityJSON", "version": "2.0", "vertices": [[0, 0, 1e999]], '
            '"CityObjects": {}}',
            "not finite",
        ),
        (
            '{"type": "CityJSON", "version": "2.0", "vertices": [[0, 0, 0]], "CityObjects": {"a": '
            '{"type": "Building", "geometry": [{"type": "MultiSurface", "lod": "1", '
            '"boundaries": [[[0, -1, 0]]]}]}}}',
            "vertex -1 does not exist",
        ),
        ('{"type": "CityJSON", "version": "2.0", "CityObjects": {"a": 7}}', "does not follow"),
        (
            '{"type": "CityJSON", "version": "2.0", "CityObjects": {"a": {"type": "Building", '
            '"children": ["b"]}, "b": {"type": "BuildingPart", "parents": ["a"], '
            '"children": ["b"]}}}',
            "RecursionError",
        ),
    ],
)
def test_what_cannot_be_read(tmp_path, text, message):
    path = tmp_path / "city.json"
    path.write_text(text)

    with pytest.raises(EnvgenError, match=message):
        read_cityjson(path)


def test_a_file_that_is_missing(tmp_path):
    with pytest.raises(EnvgenError, match="cannot be read"):
        read_cityjson(tmp_path / "none.json")


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2]])
def test_degrees_become_metres_of_utm(read, order):
    """JGD2011 with heights: CityJSON gives longitude first, some files do not."""
    corner = np.array([139.7, 35.7, 30.0])
    scale = [1e-9, 1e-9, 1e-3]
    degrees = np.array([[0, 0, 0], [1e-4, 0, 0], [1e-4, 1e-4, 0], [0, 1e-4, 0]])
    vertices = np.rint(degrees[:, order] / scale).astype(int).tolist()
    city = read(
        {
            "b": {
                "type": "Building",
                "geometry": [{"type": "MultiSurface", "lod": "0", "boundaries": [[[0, 1, 2, 3]]]}],
            }
        },
        vertices=vertices,
        transform={"scale": scale, "translate": corner[order].tolist()},
        metadata={"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/6697"},
    )

    points = city.objects[0].geometry["lod0MultiSurface"].points + city.offset
    to_utm = pyproj.Transformer.from_crs("EPSG:6668", "EPSG:32654", always_xy=True)
    expected = np.column_stack([*to_utm.transform(*(corner + degrees)[:, :2].T), [30.0] * 4])
    assert city.crs == "EPSG:32654"
    np.testing.assert_allclose(points, expected, atol=1e-3)
    first = "easting" if order[0] == 0 else "northing"
    assert [issue.action for issue in city.issues] == [f"read as {first} first"]
