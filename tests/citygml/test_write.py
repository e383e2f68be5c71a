"""The writer: place, coordinates, refusals."""

import re
import tracemalloc

import numpy as np
import pytest
from lxml import etree

from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city, write_features
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

GML = "{http://www.opengis.net/gml/3.2}"


def square(size=1.0, z=0.0):
    ring = np.array([[0.0, 0.0, z], [size, 0.0, z], [size, size, z], [0.0, size, z]])
    return Polygons.of_rings([ring])


def house(name="house", material=""):
    roof = ThematicSurface(f"{name}_roof", "RoofSurface", square(2.0, 3.0), 2, material)
    return CityObject(name, "Building", {"function": "1000;1010"}, (roof,), solid_lod=2)


def test_coordinates_are_those_of_the_crs(tmp_path):
    path = tmp_path / "city.gml"
    city = City((house(),), "EPSG:25832", (691000.25, 5336000.5, 500.0))
    write_city(city, path)
    root = etree.parse(str(path)).getroot()
    envelope = root.find(f"{GML}boundedBy/{GML}Envelope")
    assert envelope.get("srsName") == "urn:ogc:def:crs:EPSG::25832"
    assert envelope.findtext(f"{GML}lowerCorner") == "691000.250 5336000.500 503.000"
    assert envelope.findtext(f"{GML}upperCorner") == "691002.250 5336002.500 503.000"
    assert root.find(f".//{GML}posList").text.startswith("691000.250 5336000.500 503.000 ")


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize(
    ("crs", "far"),
    [
        (f"EPSG:{'0' * 700}25832", 0.0),
        (f"EPSG:{'٠' * 300}٢٥٨٣٢", 0.0),
        (f"+proj=tmerc +lat_0=48 +title={'Straße ' * 200}", 0.0),
        ("EPSG:25832", 1e90),
        (f"EPSG:{'0' * 60_000}25832", 1e90),
    ],
    ids=["long code", "other digits", "long header", "far away", "both"],
)
def test_no_envelope_is_cut(tmp_path, crs, far, version):
    path, plain = tmp_path / "city.gml", tmp_path / "plain.gml"
    houses = tuple(house(f"Straße_{number}") for number in range(300))
    offset = (far, far, far)
    write_city(City(houses, crs, offset), path, version)
    root = etree.parse(str(path)).getroot()
    envelope = (
        root.find(f"{GML}boundedBy/{GML}Envelope")
        if version == "3.0"
        else root.find(".//{http://www.opengis.net/gml}Envelope")
    )
    upper = [float(value) for value in envelope[1].text.split()]
    assert upper == pytest.approx([far + 2.0, far + 2.0, far + 3.0])
    # What follows is that of a file whose envelope has its usual length.
    write_city(City(houses, "EPSG:25832", offset), plain, version)
    members = [file.read_bytes().partition(b"<cityObjectMember>")[2] for file in (path, plain)]
    assert members[0] == members[1]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["city.gml", "plain.gml"]


@pytest.mark.parametrize(
    ("crs", "code"),
    [
        ("EPSG:25832", "25832"),
        ("urn:ogc:def:crs:EPSG::3857", "3857"),
        ("urn:ogc:def:crs:EPSG:9.9:3857", "3857"),
        ("+proj=utm +zone=32 +ellps=GRS80 +units=m +no_defs", "25832"),
        ("+proj=tmerc +lat_0=48.1 +lon_0=11.3 +ellps=WGS84", None),
        ("+proj=longlat +datum=WGS84 +no_defs", None),
        ("no crs at all", None),
        ("", None),
    ],
)
def test_only_a_registered_crs_is_named(tmp_path, crs, code):
    path = tmp_path / "city.gml"
    write_city(City((house(),), crs), path)
    found = re.search(r'srsName="urn:ogc:def:crs:EPSG::(\d+)"', path.read_text())
    assert (found[1] if found else None) == code
    assert read_city(path).crs == crs


def test_the_solid_refers_to_the_polygons_of_the_surfaces(tmp_path):
    path = tmp_path / "city.gml"
    write_city(City((house(),)), path)
    root = etree.parse(str(path)).getroot()
    ids = {polygon.get(f"{GML}id") for polygon in root.iter(f"{GML}Polygon")}
    members = [e for shell in root.iter(f"{GML}Shell") for e in shell]
    assert {e.get("{http://www.w3.org/1999/xlink}href") for e in members} == {f"#{i}" for i in ids}


def test_several_codes_are_several_elements_with_a_code_space(tmp_path):
    path = tmp_path / "city.gml"
    write_city(City((house(),)), path)
    found = re.findall(r'<bldg:function codeSpace="([^"]+)">(\d+)<', path.read_text())
    assert [code for _, code in found] == ["1000", "1010"]
    assert found[0][0].endswith("/_AbstractBuilding_function.xml")


@pytest.mark.parametrize(
    "feature",
    [CityObject("a", "Spaceship"), CityObject("1a", "Building"), CityObject("a b", "Road")],
)
def test_what_cannot_be_written_leaves_no_file(tmp_path, feature):
    with pytest.raises(EnvgenError):
        write_city(City((house(), feature)), tmp_path / "city.gml")
    assert list(tmp_path.iterdir()) == []


def test_an_older_file_survives_a_failure(tmp_path):
    path = tmp_path / "city.gml"
    path.write_text("old")
    with pytest.raises(EnvgenError):
        write_city(City((CityObject("a", "Spaceship"),)), path)
    assert path.read_text() == "old"


@pytest.mark.long
def test_memory_does_not_grow_with_the_number_of_features(tmp_path):
    def peak(count):
        tracemalloc.start()
        write_features((house(f"h{i}") for i in range(count)), tmp_path / "city.gml")
        highest = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return highest

    peak(10)
    assert peak(20_000) < peak(5_000) + 200_000
