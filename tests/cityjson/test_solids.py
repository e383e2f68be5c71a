"""Solids with cavities, several solids, and several refinements of a level of detail."""

import json
from dataclasses import replace

import numpy as np
import pytest
from lxml import etree

from envgen_usd.city.plots.separate_solids import with_parts
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.solid_orientation import face_outwards
from envgen_usd.citygml.surface_semantics import classify
from envgen_usd.citygml.write import write_city
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.geometry.flat_arrays import split_solids, turned
from envgen_usd.geometry.iso19107.fault_report import city_issues
from envgen_usd.geometry.iso19107.shell_faults import volumes
from envgen_usd.models.city_model import City
from envgen_usd.models.polygon_arrays import Solids

FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]
KINDS = ["GroundSurface", "RoofSurface", *["WallSurface"] * 4]


class Blocks:
    """Axis-parallel blocks of whole metres, as CityJSON."""

    def __init__(self):
        self.vertices = []

    def shell(self, low, high, inwards=False):
        first = len(self.vertices)
        corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        self.vertices += [
            [int(1000 * (high[i] if c[i] else low[i])) for i in range(3)] for c in corners
        ]
        rings = [[first + n for n in (face[::-1] if inwards else face)] for face in FACES]
        return [[ring] for ring in rings]

    def file(self, path, *geometries, kind="Building", version="2.0"):
        file = {
            "type": "CityJSON",
            "version": version,
            "transform": {"scale": [0.001] * 3, "translate": [0, 0, 0]},
            "CityObjects": {"b": {"type": kind, "geometry": list(geometries)}},
            "vertices": self.vertices,
        }
        path.write_text(json.dumps(file))
        return path


def geometry(kind, boundaries, lod="2", values=None):
    found = {"type": kind, "lod": lod, "boundaries": boundaries}
    if values is not None:
        surfaces = [{"type": name} for name in KINDS]
        found["semantics"] = {"surfaces": surfaces, "values": values}
    return found


@pytest.fixture
def blocks():
    return Blocks()


def hollow(blocks):
    """A solid of 10 m x 10 m x 10 m with a cavity of 2 m x 3 m x 4 m."""
    return [
        blocks.shell((0, 0, 0), (10, 10, 10)),
        blocks.shell((4, 4, 4), (6, 7, 8), inwards=True),
    ]


def beside(blocks):
    """Three solids in a row; the first two touch."""
    return [[blocks.shell((x, 0, 0), (x + 5, 5, 5))] for x in (0, 5, 20)]


def volume(shape):
    """Volume of all solids; cavities count as negative."""
    shell = shape.shell if isinstance(shape, Solids) else np.zeros(len(shape), dtype=np.int64)
    return volumes(shape, shell).sum()


def shells_of(shape):
    return [shape.shell.tolist(), shape.solid.tolist(), shape.composite]


def json_again(city, folder):
    write_cityjson(city, folder / "again.json")
    return read_cityjson(folder / "again.json")


def gml_again(city, folder, schemas, version="3.0"):
    path = folder / "again.gml"
    write_city(city, path, version)
    schema = etree.XMLSchema(etree.parse(str(schemas / f"citygml-{version}.xsd")))
    assert schema.validate(etree.parse(str(path))), schema.error_log
    return read_city(path)


def test_a_cavity_is_a_shell_of_its_own(blocks, tmp_path, citygml_schemas):
    city = read_cityjson(blocks.file(tmp_path / "in.json", geometry("Solid", hollow(blocks))))

    for found in (city, json_again(city, tmp_path), gml_again(city, tmp_path, citygml_schemas)):
        solid = found.objects[0].geometry["lod2Solid"]
        assert volume(solid) == pytest.approx(1000 - 24)
        assert shells_of(solid) == [[0] * 6 + [1] * 6, [0, 0], False]
        assert city_issues(found) == ()


@pytest.mark.parametrize("kind", ["MultiSolid", "CompositeSolid"])
def test_several_solids_stay_several(blocks, tmp_path, citygml_schemas, kind):
    boundaries = beside(blocks)[:2] if kind == "CompositeSolid" else beside(blocks)[::2]
    path = blocks.file(tmp_path / "in.json", geometry(kind, boundaries), kind="Tunnel")
    city = read_cityjson(path)

    back = json_again(city, tmp_path)
    assert back.objects[0] == city.objects[0]
    item = json.loads((tmp_path / "again.json").read_text())["CityObjects"]["b"]
    assert item["geometry"][0]["type"] == kind
    for found in (city, back, gml_again(city, tmp_path, citygml_schemas)):
        solids = split_solids(found.objects[0].geometry["lod2Solid"])
        assert [volume(solid) for solid in solids] == [125.0, 125.0]
    assert city_issues(city) == ()


def test_version_2_keeps_solids_and_cavities(blocks, tmp_path, citygml_schemas):
    boundaries = [hollow(blocks), [blocks.shell((10, 0, 0), (12, 10, 10))]]
    city = read_cityjson(blocks.file(tmp_path / "in.json", geometry("CompositeSolid", boundaries)))

    (building,) = gml_again(city, tmp_path, citygml_schemas, "2.0").objects

    solids = split_solids(building.geometry["lod2Solid"])
    assert [volume(solid) for solid in solids] == [976.0, 200.0]


def test_semantics_of_a_solid_with_a_cavity(blocks, tmp_path, citygml_schemas):
    values = [[0, 1, 2, 3, 4, 5], [None] * 6]
    source = geometry("Solid", hollow(blocks), values=values)
    city = read_cityjson(blocks.file(tmp_path / "in.json", source))

    (building,) = city.objects
    assert [len(surface.polygons) for surface in building.surfaces] == [1] * 6
    assert building.solid_lod == -1
    back = json_again(city, tmp_path)
    assert back.objects[0] == building
    (written,) = json.loads((tmp_path / "again.json").read_text())["CityObjects"]["b"]["geometry"]
    assert written["semantics"]["values"] == values
    (classified,) = (classify(face_outwards(o)[0]) for o in city.objects)
    assert classified.geometry["lod2Solid"] == building.geometry["lod2Solid"]
    assert sum(len(surface.polygons) for surface in classified.surfaces) == 6
    found = gml_again(City((classified,)), tmp_path, citygml_schemas)
    assert volume(found.objects[0].geometry["lod2Solid"]) == pytest.approx(976)


def test_faces_between_two_solids_are_no_outer_surfaces(blocks, tmp_path):
    boundaries = beside(blocks)[:2]
    city = read_cityjson(blocks.file(tmp_path / "in.json", geometry("CompositeSolid", boundaries)))

    building = classify(city.objects[0])

    areas = {surface.kind: len(surface.polygons) for surface in building.surfaces}
    assert areas == {"GroundSurface": 2, "RoofSurface": 2, "WallSurface": 6}


def test_separate_solids_of_a_building_are_parts(blocks, tmp_path, citygml_schemas):
    values = [[[0, 1, 2, 3, 4, 5]]] * 3
    source = geometry("MultiSolid", beside(blocks), values=values)
    city = read_cityjson(blocks.file(tmp_path / "in.json", source))

    building = with_parts(classify(city.objects[0]))

    assert (building.surfaces, building.geometry) == ((), {})
    assert [part.kind for part in building.children] == ["BuildingPart"] * 3
    for part in building.children:
        assert part.solid_lod == 2
        assert sum(len(surface.polygons) for surface in part.surfaces) == 6
    found = gml_again(City((building,)), tmp_path, citygml_schemas)
    assert city_issues(found) == ()
    assert found.objects[0] == building


def test_shells_that_face_the_wrong_side_are_turned(blocks, tmp_path):
    right = read_cityjson(blocks.file(tmp_path / "in.json", geometry("Solid", hollow(blocks))))
    values = [[0, 1, 2, 3, 4, 5], [None] * 6]
    wrong = [
        blocks.shell((0, 0, 0), (10, 10, 10), inwards=True),
        blocks.shell((4, 4, 4), (6, 7, 8)),
    ]
    city = read_cityjson(blocks.file(tmp_path / "in.json", geometry("Solid", wrong, "2", values)))

    faced, issues = face_outwards(city.objects[0])

    assert volume(faced.geometry["lod2Solid"]) == volume(right.objects[0].geometry["lod2Solid"])
    assert [issue.kind for issue in issues] == ["iso19107.405"]
    before = city.objects[0].surfaces[1].polygons
    assert faced.surfaces[1].polygons == turned(before)


def test_the_finest_refinement_of_a_level_is_taken_and_the_others_named(blocks, tmp_path):
    block, whole = blocks.shell((0, 0, 0), (10, 10, 5)), blocks.shell((0, 0, 0), (10, 10, 7))
    roofed = blocks.shell((0, 0, 0), (10, 10, 6))
    # The finest comes first, so that the order in the file does not decide.
    path = blocks.file(
        tmp_path / "in.json",
        geometry("Solid", [whole], "1.3", [[0, 1, 2, 3, 4, 5]]),
        geometry("Solid", [block], "1.2", [[0, 1, 2, 3, 4, 5]]),
        geometry("Solid", [roofed], "2.2", [[0, 1, 2, 3, 4, 5]]),
    )

    city = read_cityjson(path)

    (building,) = city.objects
    assert volume(building.geometry["lod1Solid"]) == 700
    assert building.solid_lod == 2
    levels = [surface.lod for surface in building.surfaces]
    assert (levels.count(1), levels.count(2)) == (6, 6)
    (issue,) = city.issues
    assert (issue.kind, issue.where, issue.action) == ("city.level", "LoD 1.2", "LoD 1.3 taken")
    assert json_again(city, tmp_path).objects == city.objects


def test_real_files_with_several_refinements(shared):
    """The truth is counted in the file itself."""
    path = shared / "citymodels" / "multi_lod.json"
    items = json.loads(path.read_text())["CityObjects"].values()
    counts = {"1.2": 0, "1.3": 0, "2.2": 0}
    for item in items:
        for each in item["geometry"]:
            counts[each["lod"]] += len(each["boundaries"][0])

    city = read_cityjson(path)

    found = {
        1: sum(len(building.geometry["lod1Solid"]) for building in city.objects),
        2: sum(len(surface.polygons) for building in city.objects for surface in building.surfaces),
    }
    assert found == {1: counts["1.3"], 2: counts["2.2"]}
    assert [issue.where for issue in city.issues] == ["LoD 1.2"]
    assert city.issues[0].message.startswith("10 geometries")


@pytest.mark.parametrize("name", ["V_inner_shell", *(f"V_inner_shell_{n}" for n in range(1, 5))])
def test_valid_solids_with_cavities_stay_valid(shared, tmp_path, name):
    case = shared / "judges" / "val3dity" / "cases" / f"{name}.poly.json"
    if not case.is_file():
        pytest.skip("no cases of val3dity")

    city = read_cityjson(case)

    assert city_issues(city) == ()
    assert city_issues(json_again(city, tmp_path)) == ()


def test_two_geometries_of_the_same_level_are_both_kept(blocks, tmp_path):
    one, two = (blocks.shell((x, 0, 0), (x + 2, 2, 2)) for x in (0, 9))
    path = blocks.file(
        tmp_path / "in.json", geometry("Solid", [one]), geometry("Solid", [two]), kind="Bridge"
    )

    shape = read_cityjson(path).objects[0].geometry["lod2Solid"]

    assert [volume(solid) for solid in split_solids(shape)] == [8.0, 8.0]


def test_a_class_that_cityjson_lacks_leaves_no_hole_in_a_solid(blocks, tmp_path):
    source = geometry("Solid", [blocks.shell((0, 0, 0), (4, 5, 6))], "2", [[0, 1, 2, 3, 4, 5]])
    (building,) = read_cityjson(blocks.file(tmp_path / "in.json", source)).objects
    first, *others = building.surfaces
    generic = replace(first, kind="GenericThematicSurface")
    city = City((replace(building, surfaces=(generic, *others)),))

    (found,) = json_again(city, tmp_path).objects

    assert volume(found.geometry["lod2Solid"]) == 120
    assert [surface.kind for surface in found.surfaces] == KINDS[1:]


@pytest.mark.parametrize("version", ["3.0", "2.0"])
def test_surfaces_of_lod1_are_kept_by_every_version(shared, tmp_path, citygml_schemas, version):
    """Delft has 22,692 of them; CityGML 3.0 has no property for those of roads and terrain."""
    city = read_cityjson(shared / "citymodels" / "delft.json")
    kinds = ("Road", "PlantCover", "LandUse", "WaterBody", "GenericOccupiedSpace", "Bridge")
    city = replace(city, objects=city.of_kind(*kinds)[::20])
    wanted = sum(len(each.geometry["lod1MultiSurface"]) for each in city.objects)

    found = gml_again(city, tmp_path, citygml_schemas, version)

    count = 0
    for each in found.walk():
        count += sum(len(surface.polygons) for surface in each.surfaces)
        count += sum(map(len, each.geometry.values()))
    assert wanted > 100
    assert count == wanted
