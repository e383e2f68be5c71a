"""City → CityGML → City is the identity, and what is written is valid."""

import string

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from envgen_usd.citygml.feature_properties import (
    ENUMERATIONS,
    KINDS,
    SPACE_GEOMETRY,
    Attr,
    Child,
    Ref,
    Shape,
    Type,
)
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.models.attribute_values import Code, Date, Measure, Uri
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

millimetres = st.integers(-(10**9), 10**9).map(lambda mm: mm / 1000)
points = st.tuples(millimetres, millimetres, millimetres)
text = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=12)
words = st.text(string.ascii_letters + string.digits, min_size=1, max_size=8)
angles = st.integers(-1_500_000_000, 1_500_000_000).map(lambda nano: nano / 1e9)
beyond = words.map("../0_-1/city.gml#r{}".format)
numbers = st.floats(allow_nan=False)
rings = st.lists(points, min_size=3, max_size=6).map(np.array)


@st.composite
def polygons(draw, triangles=False):
    count = draw(st.integers(0, 3))
    groups = [draw(st.lists(rings, min_size=1, max_size=2)) for _ in range(count)]
    if triangles:
        groups = [[np.array(draw(st.tuples(points, points, points)))] for _ in range(count)]
    found = [ring for group in groups for ring in group]
    return Polygons(
        np.concatenate([np.empty((0, 3)), *found]),
        np.cumsum([0, *map(len, found)], dtype=np.int64),
        np.cumsum([0, *map(len, groups)], dtype=np.int64),
    )


dates = st.dates().map(lambda day: Date(day.isoformat()))
uris = words.map(lambda word: Uri(f"https://example.org/{word}?a=b&c#d"))
codes = st.tuples(text, uris).map(lambda pair: Code(pair[0], str(pair[1])))
measures = st.tuples(numbers, st.sampled_from(("m", "m2", "urn:ogc:def:uom:UCUM::m"))).map(
    lambda pair: Measure(*pair)
)
values = (
    st.none() | st.booleans() | st.integers() | numbers | text | dates | uris | codes | measures
)
plain_values = st.none() | st.booleans() | st.integers() | numbers | text
plain_lists = st.recursive(
    plain_values, lambda inner: st.lists(inner, max_size=3).map(tuple), max_leaves=5
)
generics = st.recursive(
    values | plain_lists,
    lambda inner: (
        st.dictionaries(words, inner, max_size=3)
        | st.lists(values, min_size=2, max_size=3).map(tuple)
    ),
    max_leaves=5,
)
"""Any attribute; lists of fewer than two items or of lists have only types of JSON."""


class Names:
    """Ids that are unique in a city."""

    def __init__(self):
        self.count = 0

    def __call__(self):
        self.count += 1
        return f"id_{self.count}-ä.{self.count % 3}"


VALUES = {
    Type.CODE: words,
    Type.BOOLEAN: st.booleans(),
    Type.DATE: dates,
    Type.INT: st.integers(0, 99),
    Type.LENGTH: st.floats(0, 1e6),
    Type.LENGTHS: st.lists(st.floats(0, 1e3), min_size=1, max_size=3).map(tuple),
    Type.HEIGHT: st.floats(0, 1e6),
}


@st.composite
def attributes(draw, kind):
    found = {}
    for slot in KINDS[kind].slots:
        if isinstance(slot, Attr) and (slot.name in ("granularity", "lod") or draw(st.booleans())):
            words_of = st.sampled_from(sorted(ENUMERATIONS.get(slot.name, ("",))))
            found[slot.name] = draw(VALUES.get(slot.type, words_of))
            if slot.name == "lod":
                found[slot.name] = draw(st.integers(0, 3))
    if draw(st.booleans()):
        found["name"] = draw(text)
    if KINDS[kind].shape is Shape.SPACE and draw(st.booleans()):
        found["spaceType"] = draw(st.sampled_from(("closed", "open", "semiOpen")))
    generic = st.dictionaries(words.map(lambda word: f"g_{word}"), generics, max_size=3)
    return {**found, **draw(generic)}


@st.composite
def surface(draw, names, kind, lods=(0, 1, 2, 3), openings=True):
    holes = []
    if openings and KINDS[kind].prefix == "con":
        for opening in draw(
            st.lists(st.sampled_from(("WindowSurface", "DoorSurface")), max_size=2)
        ):
            holes.append(draw(surface(names, opening, lods, openings=False)))
    return ThematicSurface(
        names(),
        kind,
        draw(polygons()),
        draw(st.sampled_from(lods)),
        draw(st.sampled_from(("", "brick_red", "no_such_material"))),
        draw(attributes(kind)),
        tuple(holes),
    )


SURFACES = ("WallSurface", "RoofSurface", "GroundSurface", "TrafficArea", "GenericThematicSurface")
OCCUPIED = frozenset(
    (
        "Building",
        "BuildingInstallation",
        "BuildingFurniture",
        "CityFurniture",
        "GenericOccupiedSpace",
        "OtherConstruction",
        "PlantCover",
        "SolitaryVegetationObject",
    )
)
"""Classes that may be given by an implicit geometry."""
# The surfaces of lod 2 may be a solid already.
BODIES = [name for name in SPACE_GEOMETRY if name.endswith(("Solid", "Surface"))]
BODIES.remove("lod2Solid")


@st.composite
def feature(draw, names, kind, depth=0):
    shape = KINDS[kind].shape
    space = shape is Shape.SPACE
    kinds = [
        draw(st.sampled_from(SURFACES)) for _ in range(draw(st.integers(0, 2)) if space else 0)
    ]
    surfaces = [draw(surface(names, name)) for name in kinds]
    children, refs = [], []
    for slot in KINDS[kind].slots:
        if isinstance(slot, Ref):
            refs.append(slot.name)
        if isinstance(slot, Child) and depth < 2 and slot.name != "marking":
            if kind != "ReliefFeature" and draw(st.booleans()):
                continue
            children.append(draw(feature(names, draw(st.sampled_from(slot.kinds)), depth + 1)))
        if isinstance(slot, Child) and slot.name == "marking":
            surfaces += [draw(surface(names, "Marking"))] * draw(st.integers(0, 1))
    # A solid refers to polygons of its lod; without any there is none.
    shell = [s for wall in surfaces for s in (wall, *wall.openings) if s.lod == 2]
    solid_lod = draw(st.sampled_from((-1, 2))) if any(len(s.polygons) for s in shell) else -1
    geometry, curves, placement = {}, {}, None
    if space:
        # A shell without any polygon cannot be told from one that refers to the surfaces.
        bodies = st.dictionaries(st.sampled_from(BODIES), polygons(), max_size=2)
        geometry = {name: shell for name, shell in draw(bodies).items() if len(shell)}
        lines = st.lists(st.lists(points, min_size=2, max_size=4).map(np.array), max_size=2)
        names_of_curves = [name for name in SPACE_GEOMETRY if name.endswith("MultiCurve")]
        curves = draw(
            st.dictionaries(st.sampled_from(names_of_curves), lines.map(tuple), max_size=2)
        )
    elif kind == "TINRelief":
        geometry = {"tin": draw(polygons(triangles=True))}
    elif shape is Shape.SURFACE:
        geometry = {"lod2MultiSurface": draw(polygons())}
    if kind in OCCUPIED and draw(st.booleans()):
        placement = Placement(
            np.array(draw(points)),
            draw(st.integers(-3_141_000_000, 3_141_000_000)) / 1e9,
            np.array(draw(st.tuples(*[st.floats(0, 99)] * 3))),
            draw(words),
            draw(angles),
            draw(st.integers(-3_141_000_000, 3_141_000_000)) / 1e9,
        )
    roles = st.sampled_from(("laneChangeLeft", "controls", *refs))
    relations = draw(
        st.dictionaries(roles, st.lists(words.map("r{}".format) | beyond, min_size=1), max_size=2)
    )
    return CityObject(
        names(),
        kind,
        draw(attributes(kind)),
        tuple(surfaces),
        solid_lod,
        geometry,
        curves,
        placement,
        {role: tuple(ids) for role, ids in relations.items()},
        tuple(children),
    )


TOPS = (
    "Building",
    "Bridge",
    "Tunnel",
    "OtherConstruction",
    "Road",
    "Railway",
    "Square",
    "Track",
    "GenericUnoccupiedSpace",
    "CityFurniture",
    "SolitaryVegetationObject",
    "PlantCover",
    "LandUse",
    "WaterBody",
    "ReliefFeature",
    "GenericOccupiedSpace",
    "GenericLogicalSpace",
)


@st.composite
def cities(draw):
    names = Names()
    kinds = draw(st.lists(st.sampled_from(TOPS), max_size=3))
    objects = tuple(draw(feature(names, kind)) for kind in kinds)
    crs = draw(st.sampled_from(("", "EPSG:25832", "+proj=tmerc +lat_0=48 +lon_0=11 +no_defs")))
    offset = draw(st.tuples(*[st.floats(-1e6, 1e6)] * 3))
    return City(objects, crs, offset)


@settings(max_examples=40, suppress_health_check=list(HealthCheck))
@given(city=cities())
def test_what_was_written_is_valid_and_read_back_unchanged(tmp_path, difference, xsd, city):
    path = tmp_path / "city.gml"
    write_city(city, path)
    assert xsd.validate(etree.parse(str(path))), xsd.error_log
    assert difference(city, read_city(path)) is None


@settings(max_examples=40, suppress_health_check=list(HealthCheck))
@given(city=cities())
def test_what_was_written_as_version_2_is_valid(tmp_path, old_xsd, city):
    path = tmp_path / "city.gml"
    write_city(city, path, "2.0")
    assert old_xsd.validate(etree.parse(str(path))), old_xsd.error_log
