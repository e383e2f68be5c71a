"""Attributes of all types between CityJSON and CityGML; the truth is the file that came in."""

import json

import pytest
from lxml import etree

from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.models.attribute_values import Code, Date, Measure, Uri
from envgen_usd.models.city_model import City, CityObject

VALUES = {
    "text": "Größe <&\"'>",
    "number-like": "12",
    "true-like": "true",
    "int": 3,
    "double": 0.33,
    "whole": 5.0,
    "no": False,
    "yes": True,
    "null": None,
    "date": "2012-03-09",
    "no date": "2012-13-09",
    "uri": "https://www.example.org/a?b=c&d#e",
    "measure": {"value": 20.75, "uom": "m"},
    "code": {"value": "1000", "codeSpace": "https://www.example.org/codes.xml"},
    "list": ["a", 1, None, False, 2.5, "2012-03-09"],
    "single": ["a"],
    "empty": [],
    "nested": [[1, 2], [3]],
    "object": {
        "area": {"value": 140.5, "uom": "m2"},
        "by": "x",
        "deep": {"no": False, "l": [1, 2]},
    },
    "void": {},
    # Properties of the class whose values do not suit their types.
    "storeysAboveGround": "many",
    "storeysBelowGround": -1,
    "height": {"low": 3, "high": 4},
    "roofType": None,
    "storeyHeightsAboveGround": [3.5, 3.0],
    "conditionOfConstruction": "splendid",
    "dateOfConstruction": "before 1900",
}
NAMESPACES = {"gen": "http://www.opengis.net/citygml/generics/3.0"}


def write_json(attributes, path):
    building = {"type": "Building", "attributes": attributes}
    file = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [0.001] * 3, "translate": [0, 0, 0]},
        "CityObjects": {"b": building},
        "vertices": [],
    }
    path.write_text(json.dumps(file))
    return path


def attributes_of(path):
    return json.loads(path.read_text())["CityObjects"]["b"]["attributes"]


def typed(value):
    """A value with its types, as true equals 1."""
    return json.dumps(value, sort_keys=True)


def valid(path, citygml_schemas, version):
    schema = etree.XMLSchema(etree.parse(str(citygml_schemas / f"citygml-{version}.xsd")))
    schema.validate(etree.parse(str(path)))
    return [str(error) for error in schema.error_log]


def test_every_value_of_json_comes_back_from_citygml(tmp_path, citygml_schemas):
    write_city(read_cityjson(write_json(VALUES, tmp_path / "in.json")), tmp_path / "city.gml")

    write_cityjson(read_city(tmp_path / "city.gml"), tmp_path / "out.json")

    assert typed(attributes_of(tmp_path / "out.json")) == typed(VALUES)
    assert valid(tmp_path / "city.gml", citygml_schemas, "3.0") == []


def test_version_2_keeps_every_value_that_it_has_a_type_for(tmp_path, citygml_schemas):
    city = read_cityjson(write_json(VALUES, tmp_path / "in.json"))
    write_city(city, tmp_path / "city.gml", "2.0")

    write_cityjson(read_city(tmp_path / "city.gml"), tmp_path / "out.json")

    texts = {name: typed(VALUES[name]) for name in ("no", "yes", "null", "single", "empty")}
    texts |= {name: typed(VALUES[name]) for name in ("nested", "void", "roofType")}
    within = {"object": {**VALUES["object"], "deep": {"no": "false", "l": [1, 2]}}}
    listed = {"list": ["a", 1, "null", "false", 2.5, "2012-03-09"], "code": "1000"}
    expected = {**VALUES, **texts, **within, **listed}
    assert typed(attributes_of(tmp_path / "out.json")) == typed(expected)
    assert valid(tmp_path / "city.gml", citygml_schemas, "2.0") == []


@pytest.mark.parametrize("version", ["3.0", "2.0"])
def test_types_of_a_real_file_survive(shared, tmp_path, citygml_schemas, version):
    source = shared / "citymodels" / "sig3d-genericattributes-citygml2.xml"
    write_city(read_city(source), tmp_path / "city.gml", version)

    (building,) = read_city(tmp_path / "city.gml").objects

    found = {name: (type(v), v, getattr(v, "unit", "")) for name, v in building.attributes.items()}
    assert found["Bauweise"] == (str, "Massivbau", "")
    assert found["Anzahl der Eingänge"] == (int, 3, "")
    assert found["Grundflächenzahl GFZ"] == (float, 0.33, "")
    assert found["Datum der Baufreigabe"] == (Date, "2012-03-09", "")
    assert found["Web Seite"] == (Uri, "http://www.sig3d.org", "")
    assert found["Breite des Gebäudes"] == (Measure, 20.75, "#m")
    units = {name: (float(v), v.unit) for name, v in building.attributes["Basismengen"].items()}
    assert units == {"Höhe": (9, "#m"), "Grundflächen": (140, "#m2"), "Volumen": (1260, "#m3")}
    assert valid(tmp_path / "city.gml", citygml_schemas, version) == []


def test_properties_of_a_class_keep_their_types(tmp_path, citygml_schemas):
    attributes = {
        "name": ("Rathaus", "Town hall"),
        "height": Measure(30.0, "[ft_i]"),
        "storeysAboveGround": 4,
        "storeyHeightsAboveGround": (3.5, 3, 3, 2.75),
        "dateOfConstruction": Date("1904-05-01"),
        "function": ("1000", "1010"),
        "code": Code("7", "urn:x:list"),
    }
    bridge = CityObject("r", "Bridge", {"isMovable": True})
    write_city(City((CityObject("b", "Building", attributes), bridge)), tmp_path / "city.gml")

    building, bridge = read_city(tmp_path / "city.gml").objects

    assert building.attributes == {**attributes, "function": "1000;1010"}
    assert building.attributes["height"].unit == "[ft_i]"
    assert building.attributes["code"].space == "urn:x:list"
    assert bridge.attributes == {"isMovable": True}
    assert valid(tmp_path / "city.gml", citygml_schemas, "3.0") == []
    assert "genericAttribute><gen:Code" in (tmp_path / "city.gml").read_text()


def test_characters_that_xml_lacks_do_not_stop_a_city(tmp_path):
    city = City((CityObject("b", "Building", {"note": "a\x00b\x1fc\td", "n\x01": 1}),))
    write_city(city, tmp_path / "city.gml")

    (building,) = read_city(tmp_path / "city.gml").objects

    assert building.attributes == {"note": "a\ufffdb\ufffdc\td", "n\ufffd": 1}


def test_a_real_city_with_booleans_and_nulls(shared, tmp_path, citygml_schemas):
    source = shared / "citymodels" / "multi_lod.json"
    # Ids of XML do not start with a digit.
    objects = [CityObject(f"b{o.id}", o.kind, o.attributes) for o in read_cityjson(source).objects]
    write_city(City(tuple(objects)), tmp_path / "city.gml")

    write_cityjson(read_city(tmp_path / "city.gml"), tmp_path / "out.json")

    before, after = (
        json.loads(path.read_text())["CityObjects"] for path in (source, tmp_path / "out.json")
    )
    assert len(after) == 10
    for name, item in after.items():
        assert typed(item["attributes"]) == typed(before[name[1:]]["attributes"])
    assert valid(tmp_path / "city.gml", citygml_schemas, "3.0") == []
