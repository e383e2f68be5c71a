"""CityGML of other programs, in the ways in which it differs from ours."""

import numpy as np
import pyproj
import pytest

from envgen_usd.citygml.foreign_city import read_foreign
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.flat_arrays import join
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.iso19107.shell_faults import volumes
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

CORNERS = np.array([[x, y, z] for z in (0, 6) for y in (0, 8) for x in (0, 10)], dtype=float)
FACES = {
    "GroundSurface": [0, 2, 3, 1],
    "RoofSurface": [4, 5, 7, 6],
    "WallSurface": [0, 1, 5, 4],
    "WallSurface2": [1, 3, 7, 5],
    "WallSurface3": [3, 2, 6, 7],
    "WallSurface4": [2, 0, 4, 6],
}


def positions(points):
    return " ".join(
        f"{value:.9g}" if abs(value) < 1000 else f"{value:.3f}" for p in points for value in p
    )


def polygon(name, points, closed=True):
    ring = [*points, points[0]] if closed else points
    return (
        f'<gml:Polygon gml:id="{name}"><gml:exterior><gml:LinearRing><gml:posList>'
        f"{positions(ring)}</gml:posList></gml:LinearRing></gml:exterior></gml:Polygon>"
    )


def member(inner):
    return f"<gml:surfaceMember>{inner}</gml:surfaceMember>"


def box(prefix, origin=(0, 0, 0), order=(0, 1, 2)):
    """Polygon of each face of a box of 10 m by 8 m by 6 m."""
    points = (CORNERS + origin)[:, order]
    return {kind: polygon(f"{prefix}_{kind}", points[ring]) for kind, ring in FACES.items()}


def multi(faces):
    return f"<gml:MultiSurface>{''.join(map(member, faces))}</gml:MultiSurface>"


def solid(faces):
    return (
        "<gml:Solid><gml:exterior><gml:CompositeSurface>"
        f"{''.join(map(member, faces))}</gml:CompositeSurface></gml:exterior></gml:Solid>"
    )


@pytest.fixture
def read(tmp_path):
    def read_text(inner, version="2.0", srs="", **wanted):
        gml = "http://www.opengis.net/gml" + ("/3.2" if version == "3.0" else "")
        modules = {
            **{"bldg": "building", "frn": "cityfurniture", "veg": "vegetation", "gen": "generics"},
            **{"tran": "transportation", "dem": "relief", "luse": "landuse", "wtr": "waterbody"},
            **({"con": "construction"} if version == "3.0" else {}),
        }
        prefixes = " ".join(
            f'xmlns:{prefix}="http://www.opengis.net/citygml/{module}/{version}"'
            for prefix, module in modules.items()
        )
        envelope = f'<gml:Envelope srsName="{srs}"/>'
        bounds = f"<gml:boundedBy>{envelope}</gml:boundedBy>" if srs else ""
        members = "".join(f"<cityObjectMember>{item}</cityObjectMember>" for item in inner)
        path = tmp_path / "city.gml"
        path.write_text(
            f'<?xml version="1.0" encoding="UTF-8"?><CityModel {prefixes} '
            f'xmlns="http://www.opengis.net/citygml/{version}" xmlns:gml="{gml}" '
            f'xmlns:xlink="http://www.w3.org/1999/xlink">{bounds}{members}</CityModel>'
        )
        return read_city(path, **wanted)

    return read_text


def test_lod4_takes_the_place_of_lod3(read):
    faces = list(box("c", (0, 0, 3)).values())
    city = read(
        [
            f'<bldg:Building gml:id="b"><bldg:lod3Solid>{solid(box("a").values())}</bldg:lod3Solid>'
            f"<bldg:lod4Solid>{solid(faces)}</bldg:lod4Solid></bldg:Building>"
        ]
    )

    points = np.concatenate([s.polygons.points for s in city.objects[0].surfaces])
    assert (points[:, 2].min(), points[:, 2].max()) == (3, 9)
    assert [(issue.kind, issue.message) for issue in city.issues] == [
        ("city.level", "lod3Solid gives way to lod4Solid")
    ]


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_solid_with_a_cavity_whose_shells_refer_to_surfaces(read, version):
    outer = box("o")
    inner = {
        kind: polygon(f"i_{kind}", (0.5 * CORNERS + 2)[ring[::-1]]) for kind, ring in FACES.items()
    }
    surface, bldg, name = {"2.0": ("bldg", "bldg:", "boundedBy"), "3.0": ("con", "", "boundary")}[
        version
    ]
    walls = "".join(
        f"<{bldg}{name}><{surface}:WallSurface gml:id='{kind}'><{bldg}lod2MultiSurface>"
        f"{multi([face])}</{bldg}lod2MultiSurface></{surface}:WallSurface></{bldg}{name}>"
        for kind, face in outer.items()
    )
    references = "".join(f'<gml:surfaceMember xlink:href="#o_{kind}"/>' for kind in FACES)
    body = (
        f"<{bldg}lod2Solid><gml:Solid><gml:exterior><gml:CompositeSurface>{references}"
        "</gml:CompositeSurface></gml:exterior><gml:interior><gml:CompositeSurface>"
        f"{''.join(map(member, inner.values()))}</gml:CompositeSurface></gml:interior></gml:Solid>"
        f"</{bldg}lod2Solid>"
    )

    city = read([f'<bldg:Building gml:id="b">{body}{walls}</bldg:Building>'], version)

    (building,) = city.objects
    shape = building.geometry["lod2Solid"]
    assert volumes(shape, shape.shell).tolist() == [480, -60]
    assert shape.solid.tolist() == [0, 0]
    assert sum(len(surface.polygons) for surface in building.surfaces) == 6


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_lod1_block_with_attributes(read, version):
    attributes = (
        '<gen:stringAttribute name="Gemeinde"><gen:value>Köln</gen:value></gen:stringAttribute>'
        '<gen:intAttribute name="age"><gen:value>44</gen:value></gen:intAttribute>'
        '<gen:measureAttribute name="area"><gen:value uom="m2">80.5</gen:value>'
        "</gen:measureAttribute>"
    )
    (building,) = read(
        [
            f'<bldg:Building gml:id="b"><gml:name>Rathaus</gml:name>{attributes}'
            "<bldg:function>1000</bldg:function><bldg:roofType>3100</bldg:roofType>"
            '<bldg:measuredHeight uom="m">6.0</bldg:measuredHeight>'
            "<bldg:storeysAboveGround>2</bldg:storeysAboveGround>"
            f"<bldg:lod1Solid>{solid(box('b').values())}</bldg:lod1Solid></bldg:Building>"
        ],
        version,
    ).objects

    assert (building.id, building.kind) == ("b", "Building")
    assert building.attributes == {
        **{"name": "Rathaus", "Gemeinde": "Köln", "age": 44, "area": 80.5, "function": "1000"},
        **{"roofType": "3100", "height": 6.0, "storeysAboveGround": 2},
    }
    assert [surface.kind for surface in building.surfaces] == [
        *("WallSurface", "RoofSurface", "GroundSurface")
    ]
    assert [len(surface.polygons) for surface in building.surfaces] == [4, 1, 1]
    assert (building.solid_lod, dict(building.geometry)) == (1, {})
    assert find_faults(Bodies.of_solid(shell_of(building))) == []


def surfaces(faces, wrap):
    return "".join(
        f'<bldg:boundedBy><bldg:{kind.rstrip("234")} gml:id="s_{kind}"><bldg:lod2MultiSurface>'
        f"{multi([wrap(face, kind)])}</bldg:lod2MultiSurface></bldg:{kind.rstrip('234')}>"
        "</bldg:boundedBy>"
        for kind, face in faces.items()
    )


def reference(name):
    return f'<gml:surfaceMember xlink:href="#{name}"/>'


def shell_of(building):
    return join([surface.polygons for surface in building.surfaces])


def test_semantics_with_a_solid_that_refers_to_the_surfaces(read):
    faces = box("p")
    references = "".join(reference(f"p_{kind}") for kind in faces)
    (building,) = read(
        [
            f'<bldg:Building gml:id="b">{surfaces(faces, lambda face, _: face)}<bldg:lod2Solid>'
            f"<gml:Solid><gml:exterior><gml:CompositeSurface>{references}</gml:CompositeSurface>"
            "</gml:exterior></gml:Solid></bldg:lod2Solid></bldg:Building>"
        ]
    ).objects

    assert [surface.kind for surface in building.surfaces] == [k.rstrip("234") for k in FACES]
    assert (building.solid_lod, dict(building.geometry)) == (2, {})
    assert find_faults(Bodies.of_solid(shell_of(building))) == []


def test_semantics_that_refer_to_the_polygons_of_the_solid(read):
    faces = box("p")
    wrapped = "".join(
        f'<bldg:boundedBy><bldg:{kind.rstrip("234")} gml:id="s_{kind}"><bldg:lod2MultiSurface>'
        f"<gml:MultiSurface>{reference(f'p_{kind}')}</gml:MultiSurface></bldg:lod2MultiSurface>"
        f"</bldg:{kind.rstrip('234')}></bldg:boundedBy>"
        for kind in faces
    )
    (building,) = read(
        [
            f'<bldg:Building gml:id="b"><bldg:lod2Solid>{solid(faces.values())}</bldg:lod2Solid>'
            f"{wrapped}</bldg:Building>"
        ]
    ).objects

    assert (building.solid_lod, dict(building.geometry)) == (2, {})
    assert find_faults(Bodies.of_solid(shell_of(building))) == []


def test_polygons_of_a_solid_without_a_class_get_one(read):
    faces = box("p")
    roof = {"RoofSurface": faces["RoofSurface"]}
    rest = [reference("p_RoofSurface"), *(member(f) for k, f in faces.items() if k not in roof)]
    (building,) = read(
        [
            f'<bldg:Building gml:id="b">{surfaces(roof, lambda face, _: face)}<bldg:lod2Solid>'
            f"<gml:Solid><gml:exterior><gml:CompositeSurface>{''.join(rest)}"
            "</gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod2Solid></bldg:Building>"
        ]
    ).objects

    assert building.surfaces[0].id == "s_RoofSurface"
    assert [(s.kind, len(s.polygons)) for s in building.surfaces[1:]] == [
        ("WallSurface", 4),
        ("GroundSurface", 1),
    ]
    assert (building.solid_lod, dict(building.geometry)) == (2, {})
    assert find_faults(Bodies.of_solid(shell_of(building))) == []


def test_roofs_that_overhang_and_coarser_levels(read):
    """A mansard of 75 degrees is a roof; what looks down high above the ground is a ceiling."""
    slope = [(0, 0, 6), (10, 0, 6), (10, 1, 9.7), (0, 1, 9.7)]
    eaves = [(0, 0, 6), (10, 0, 6), (10, -1, 6), (0, -1, 6)]
    faces = [polygon("m", np.array(slope, float)), polygon("e", np.array(eaves, float))]
    (building,) = read(
        [
            f'<bldg:Building gml:id="b"><bldg:lod1Solid>{solid(box("p").values())}</bldg:lod1Solid>'
            f"<bldg:lod2MultiSurface>{multi([*faces, box('q')['GroundSurface']])}"
            "</bldg:lod2MultiSurface></bldg:Building>"
        ]
    ).objects

    assert [surface.kind for surface in building.surfaces] == [
        *("RoofSurface", "GroundSurface", "OuterCeilingSurface")
    ]
    assert list(building.geometry) == ["lod1Solid"]
    assert building.solid_lod == -1


def test_surfaces_that_are_used_backwards(read):
    points = CORNERS[FACES["GroundSurface"]]
    turned = (
        '<gml:OrientableSurface orientation="-"><gml:baseSurface>'
        f"{polygon('p', points[::-1])}</gml:baseSurface></gml:OrientableSurface>"
    )
    faces = [turned, *list(box("q").values())[1:]]
    (building,) = read(
        [
            f'<bldg:Building gml:id="b"><bldg:lod1Solid>{solid(faces)}</bldg:lod1Solid>'
            "</bldg:Building>"
        ]
    ).objects

    assert find_faults(Bodies.of_solid(shell_of(building))) == []


def test_openings_parts_and_lod4(read):
    window = (
        '<bldg:opening><bldg:Window gml:id="w"><bldg:lod3MultiSurface>'
        f"{multi([polygon('wp', CORNERS[FACES['WallSurface']] * 0.1)])}</bldg:lod3MultiSurface>"
        "</bldg:Window></bldg:opening>"
    )
    wall = (
        '<bldg:boundedBy><bldg:WallSurface gml:id="wall"><bldg:lod3MultiSurface>'
        f"{multi([box('p')['WallSurface']])}</bldg:lod3MultiSurface>{window}</bldg:WallSurface>"
        "</bldg:boundedBy>"
    )
    chimney = (
        '<bldg:outerBuildingInstallation><bldg:BuildingInstallation gml:id="c">'
        f"<bldg:lod4Geometry>{solid(box('c').values())}</bldg:lod4Geometry>"
        "</bldg:BuildingInstallation></bldg:outerBuildingInstallation>"
    )
    part = (
        '<bldg:consistsOfBuildingPart><bldg:BuildingPart gml:id="part"><bldg:lod1Solid>'
        f"{solid(box('q').values())}</bldg:lod1Solid></bldg:BuildingPart>"
        "</bldg:consistsOfBuildingPart>"
    )
    footprint = f"<bldg:lod0FootPrint>{multi([box('f')['GroundSurface']])}</bldg:lod0FootPrint>"
    edge = f"<bldg:lod0RoofEdge>{multi([box('e')['RoofSurface']])}</bldg:lod0RoofEdge>"
    (building,) = read(
        [f'<bldg:Building gml:id="b">{footprint}{edge}{wall}{chimney}{part}</bldg:Building>']
    ).objects

    assert building.geometry["lod0MultiSurface"].points[:, 2].max() == 0
    (found,) = building.surfaces
    assert [opening.kind for opening in found.openings] == ["WindowSurface"]
    assert {(child.kind, child.solid_lod) for child in building.children} == {
        ("BuildingInstallation", 3),
        ("BuildingPart", 1),
    }


def test_roads_get_traffic_spaces(read):
    areas = "".join(
        f'<tran:{role}><tran:{kind} gml:id="{kind}"><tran:function>1</tran:function>'
        f"<tran:lod2MultiSurface>{multi([box(kind)['GroundSurface']])}</tran:lod2MultiSurface>"
        f"</tran:{kind}></tran:{role}>"
        for role, kind in (
            ("trafficArea", "TrafficArea"),
            ("auxiliaryTrafficArea", "AuxiliaryTrafficArea"),
        )
    )
    (road,) = read([f'<tran:Road gml:id="r">{areas}</tran:Road>']).objects

    assert [child.kind for child in road.children] == ["TrafficSpace", "AuxiliaryTrafficSpace"]
    area = road.children[0].surfaces[0]
    assert (area.id, area.kind, area.lod) == ("TrafficArea", "TrafficArea", 2)
    assert area.attributes["function"] == "1"


def implicit(relative, matrix="2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1", at="5 6 7"):
    return (
        f"<ImplicitGeometry><transformationMatrix>{matrix}</transformationMatrix>{relative}"
        f"<referencePoint><gml:Point><gml:pos>{at}</gml:pos></gml:Point></referencePoint>"
        "</ImplicitGeometry>"
    )


def test_implicit_geometry_that_other_features_share(read):
    shape = multi(box("t").values()).replace("<gml:MultiSurface", '<gml:MultiSurface gml:id="tree"')
    first = implicit(f"<relativeGMLGeometry>{shape}</relativeGMLGeometry>")
    second = implicit(
        '<relativeGMLGeometry xlink:href="#tree"/>', "0 -1 0 0 1 0 0 0 0 0 1 0 0 0 0 1", "1 2 3"
    )
    lamp = implicit(
        "<mimeType>model/vrml</mimeType><libraryObject>lamp.wrl</libraryObject>", at="0 0 0"
    )
    city = read(
        [
            f'<veg:SolitaryVegetationObject gml:id="{name}"><veg:lod3ImplicitRepresentation>{shape}'
            "</veg:lod3ImplicitRepresentation></veg:SolitaryVegetationObject>"
            for name, shape in (("a", first), ("b", second))
        ]
        + [
            f'<frn:CityFurniture gml:id="c"><frn:lod2ImplicitRepresentation>{lamp}'
            "</frn:lod2ImplicitRepresentation></frn:CityFurniture>"
        ]
    )

    one, two, three = (feature.placement for feature in city.objects)
    assert (one.template, two.template, three.template) == ("tree", "tree", "lamp.wrl")
    assert one.size.tolist() == [20, 16, 12]
    assert two.size.tolist() == [10, 8, 6]
    assert two.position.tolist() == [1, 2, 3]
    assert two.heading == pytest.approx(np.pi / 2)
    assert city.objects[0].attributes == {}


@pytest.mark.parametrize(
    ("version", "role", "word"),
    [("3.0", "relativeGeometry", ""), ("2.0", "relativeGMLGeometry", "bldg:")],
)
def test_templates_of_buildings_become_their_geometry(read, version, role, word):
    """A box that is turned by a quarter and doubled, and shared by one that is mirrored."""
    shape = multi(box("t").values()).replace("<gml:MultiSurface", '<gml:MultiSurface gml:id="t"')
    first = implicit(f"<{role}>{shape}</{role}>", "0 -2 0 0 2 0 0 0 0 0 2 1 0 0 0 1", "100 50 7")
    second = implicit(f'<{role} xlink:href="#t"/>', "-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "9 0 0")
    city = read(
        [
            f'<bldg:Building gml:id="{name}"><{word}lod2ImplicitRepresentation>{inner}'
            f"</{word}lod2ImplicitRepresentation></bldg:Building>"
            for name, inner in (("a", first), ("b", second))
        ],
        version,
    )

    corners = [np.concatenate([s.polygons.points for s in b.surfaces]) for b in city.objects]
    moved = corners[0] + city.offset
    assert (moved.min(axis=0).tolist(), moved.max(axis=0).tolist()) == (
        [100 - 16, 50, 8],
        [100, 70, 20],
    )
    assert np.ptp(corners[1], axis=0).tolist() == [10, 8, 6]
    for building in city.objects:
        assert (building.placement, building.attributes) == (None, {})
        assert {s.kind: len(s.polygons) for s in building.surfaces} == {
            **{"WallSurface": 4, "RoofSurface": 1, "GroundSurface": 1}
        }
        assert find_faults(Bodies.of_solid(shell_of(building))) == []


def test_relief_land_use_water_and_generic_objects(read):
    triangle = polygon("t", CORNERS[[0, 1, 2]]).replace("Polygon", "Triangle")
    city = read(
        [
            '<dem:ReliefFeature gml:id="r"><dem:lod>1</dem:lod><dem:reliefComponent>'
            '<dem:TINRelief gml:id="tin"><dem:lod>1</dem:lod><dem:tin><gml:TriangulatedSurface>'
            f"<gml:trianglePatches>{triangle}</gml:trianglePatches></gml:TriangulatedSurface>"
            "</dem:tin></dem:TINRelief></dem:reliefComponent></dem:ReliefFeature>",
            '<luse:LandUse gml:id="l"><luse:class>1000</luse:class><luse:lod1MultiSurface>'
            f"{multi([box('l')['GroundSurface']])}</luse:lod1MultiSurface></luse:LandUse>",
            '<wtr:WaterBody gml:id="w"><wtr:boundedBy><wtr:WaterSurface gml:id="ws">'
            f"<wtr:lod2Surface>{box('w')['RoofSurface']}</wtr:lod2Surface></wtr:WaterSurface>"
            "</wtr:boundedBy></wtr:WaterBody>",
            f'<gen:GenericCityObject gml:id="g"><gen:lod1Geometry>{solid(box("g").values())}'
            "</gen:lod1Geometry></gen:GenericCityObject>",
        ]
    )

    assert [feature.kind for feature in city.objects] == [
        *("ReliefFeature", "LandUse", "WaterBody", "GenericOccupiedSpace")
    ]
    assert len(city.objects[0].children[0].geometry["tin"]) == 1
    assert len(city.objects[1].geometry["lod1MultiSurface"]) == 1
    assert len(city.objects[2].surfaces[0].polygons) == 1
    assert list(city.objects[3].geometry) == ["lod1Solid"]


def test_version_3_0_of_another_program(read):
    faces = box("p")
    walls = "".join(
        f'<boundary><con:{kind.rstrip("234")} gml:id="s_{kind}"><lod2MultiSurface>{multi([face])}'
        f"</lod2MultiSurface></con:{kind.rstrip('234')}></boundary>"
        for kind, face in faces.items()
    )
    references = "".join(reference(f"p_{kind}") for kind in faces)
    (building,) = read(
        [
            f'<bldg:Building gml:id="b">{walls}<lod2Solid><gml:Solid><gml:exterior><gml:Shell>'
            f"{references}</gml:Shell></gml:exterior></gml:Solid></lod2Solid></bldg:Building>"
        ],
        "3.0",
    ).objects

    assert building.solid_lod == 2
    assert find_faults(Bodies.of_solid(shell_of(building))) == []


def ground(points):
    face = f"<bldg:lod1MultiSurface>{multi([polygon('g', points)])}</bldg:lod1MultiSurface>"
    return [f'<bldg:Building gml:id="b">{face}</bldg:Building>']


def points_of(city):
    (surface,) = city.objects[0].surfaces
    return surface.polygons.points


UTM = np.array(
    [[691010.5, 5336020.25, 515.0], [691020.5, 5336020.25, 515], [691020.5, 5336030.25, 515]]
)


@pytest.mark.parametrize(
    "srs",
    [
        "EPSG:25832",
        "urn:ogc:def:crs:EPSG::25832",
        "urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::5783",
        "http://www.opengis.net/def/crs/EPSG/0/25832",
        "urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH",
    ],
)
def test_names_of_one_crs(read, srs):
    city = read(ground(UTM), srs=srs)

    assert (city.crs, city.offset) == ("EPSG:25832", (691000.0, 5336000.0, 0.0))
    np.testing.assert_array_equal(points_of(city), UTM - city.offset)


def lon_lat(points):
    to_degrees = pyproj.Transformer.from_crs("EPSG:25832", "EPSG:4979", always_xy=True)
    lon, lat = to_degrees.transform(points[:, 0], points[:, 1])
    return np.column_stack([lon, lat, points[:, 2]])


@pytest.mark.parametrize(
    ("srs", "order"),
    [
        ("urn:ogc:def:crs:EPSG::4326", [1, 0, 2]),
        ("http://www.opengis.net/def/crs/EPSG/0/4258", [1, 0, 2]),
        ("EPSG:4326", [0, 1, 2]),
    ],
)
def test_degrees_become_metres(read, srs, order):
    degrees = lon_lat(UTM)[:, order]
    text = " ".join(f"{value:.12f}" for point in [*degrees, degrees[0]] for value in point)
    face = polygon("g", UTM).replace(positions([*UTM, UTM[0]]), text)
    inner = f"<bldg:lod1MultiSurface>{multi([face])}</bldg:lod1MultiSurface>"

    city = read([f'<bldg:Building gml:id="b">{inner}</bldg:Building>'], srs=srs)

    assert city.crs == "EPSG:32632"
    np.testing.assert_allclose(points_of(city) + city.offset, UTM, atol=2e-3)


@pytest.mark.parametrize(
    ("east", "north", "code"),
    [
        (10.75, 59.91, 32632),  # Oslo
        (151.21, -33.87, 32756),  # Sydney
        (-78.47, -0.18, 32717),  # Quito
        (177.51, 64.73, 32660),  # Anadyr
        (-179.5, 71.0, 32601),  # Wrangel Island
        (6.0, 50.0, 32632),  # on the border of two zones, the eastern one
        (9.0, 0.0, 32632),  # on the equator, the northern one
    ],
)
def test_degrees_become_metres_of_the_zone_that_holds_them(read, east, north, code):
    degrees = np.array([[east, north, 0], [east + 1e-4, north, 0], [east, north + 1e-4, 0]])
    city = read(ground(degrees), srs="EPSG:4326")
    assert city.crs == f"EPSG:{code}"


@pytest.mark.parametrize("north", [-85.0, 88.0])
def test_degrees_outside_all_zones_get_a_map_of_their_own(read, north):
    """One degree of latitude is 111.5 km near the poles (WGS 84)."""
    degrees = np.array([[9.0, north, 0], [9.1, north, 0], [9.0, north + 0.1, 0]])
    city = read(ground(degrees), srs="EPSG:4326")
    first, _, third = points_of(city)
    assert np.linalg.norm(third - first) == pytest.approx(11_166, rel=1e-3)
    assert pyproj.CRS(city.crs).is_projected


def test_degrees_beyond_the_poles_are_refused(read):
    degrees = np.array([[9.0, 500.0, 0], [9.1, 500.0, 0], [9.0, 500.1, 0]])
    with pytest.raises(EnvgenError, match=r"500 degrees north lie on no map; correct the coord"):
        read(ground(degrees), srs="EPSG:4326")


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2]])
def test_solids_tell_the_order_of_the_axes(read, order):
    """Both orders lie in the area of use of the Berlin grid; PROJ gives the true place."""
    origin = np.array([24_750.0, 20_400.0, 35.0])
    faces = box("b", origin, order).values()
    shape = f"<bldg:lod2Solid>{solid(faces)}</bldg:lod2Solid>"
    srs = "urn:ogc:def:crs,crs:EPSG:6.12:3068,crs:EPSG:6.12:5783"
    city = read([f'<bldg:Building gml:id="b">{shape}</bldg:Building>'], srs=srs)

    shell = join([surface.polygons for surface in city.objects[0].surfaces])
    assert (shell.points + city.offset).min(axis=0).tolist() == origin.tolist()
    assert find_faults(Bodies.of_solid(shell)) == []
    expected = "read as easting first" if order[0] == 0 else "read as northing first"
    assert [i.action for i in city.issues if i.kind == "city.axis_order"] == [expected]


def test_northing_first_as_the_authority_says(read):
    """DHDN / 3-degree Gauss-Krüger zone 4: its first axis looks north."""
    gauss = np.array(
        [[4468500.0, 5333500.0, 510.0], [4468510, 5333500, 510], [4468510, 5333510, 510]]
    )

    by_the_book = read(ground(gauss[:, [1, 0, 2]]), srs="urn:ogc:def:crs:EPSG::31468")
    as_often_seen = read(ground(gauss), srs="urn:ogc:def:crs:EPSG::31468")
    of_a_survey = read(ground(gauss), srs="urn:adv:crs:DE_DHDN_3GK4*DE_DHHN92_NH")

    for city in (by_the_book, as_often_seen, of_a_survey):
        assert (city.crs, city.offset) == ("EPSG:31468", (4468500.0, 5333500.0, 0.0))
        np.testing.assert_array_equal(points_of(city), gauss - city.offset)


def test_a_wanted_frame(read):
    city = read(
        ground(UTM), srs="EPSG:25832", crs="EPSG:25833", offset=(235000.0, 5340000.0, 500.0)
    )

    to_other = pyproj.Transformer.from_crs("EPSG:25832", "EPSG:25833", always_xy=True)
    x, y = to_other.transform(UTM[:, 0], UTM[:, 1])
    expected = np.column_stack([x, y, UTM[:, 2]]) - [235000, 5340000, 500]
    np.testing.assert_allclose(points_of(city), expected, atol=1e-3)
    assert (city.crs, city.offset) == ("EPSG:25833", (235000.0, 5340000.0, 500.0))


def test_a_crs_that_is_none(read):
    assert read(ground(CORNERS[[0, 1, 3]]), srs="urn:local").crs == ""
    with pytest.raises(EnvgenError, match="not a coordinate reference system"):
        read(ground(UTM), srs="EPSG:25832", crs="EPSG:x")


def test_single_positions_old_coordinates_and_open_rings(read):
    points = CORNERS[[0, 1, 3]]
    single = "".join(f"<gml:pos>{positions([p])}</gml:pos>" for p in [*points, points[0]])
    commas = " ".join(",".join(f"{v:g}" for v in p) for p in [*points, points[0]])
    listed = f"<gml:posList>{positions([*points, points[0]])}</gml:posList>"
    ring = polygon("r", points).replace(listed, "{}")
    faces = [
        ring.format(single),
        ring.format(f"<gml:coordinates>{commas}</gml:coordinates>"),
        polygon("open", points, closed=False),
        ring.format('<gml:posList srsDimension="2">0 0 10 0 10 8 0 0</gml:posList>'),
        ring.format("<gml:posList>0 0 0 1 0 0 0 0 0</gml:posList>"),
        ring.format("<gml:posList>0 0 0 1 x 0 0 0 0 0 0 0</gml:posList>"),
    ]
    inner = f"<bldg:lod1MultiSurface>{multi(faces)}</bldg:lod1MultiSurface>"

    found = points_of(read([f'<bldg:Building gml:id="b">{inner}</bldg:Building>']))

    assert found.reshape(-1, 3, 3).tolist() == [points.tolist()] * 4


def test_groups_and_references_to_nothing_do_no_harm(read):
    city = read(
        [
            '<CityObjectGroup gml:id="x"/>',
            '<bldg:Building gml:id="b"><bldg:lod2Solid xlink:href="#none"/></bldg:Building>',
        ]
    )

    (building,) = city.objects
    assert (building.id, building.solid_lod, dict(building.geometry)) == ("b", -1, {})


def test_where_a_building_meets_the_terrain(read):
    line = f"<gml:LineString><gml:posList>{positions(CORNERS[:2])}</gml:posList></gml:LineString>"
    (building,) = read(
        [
            '<bldg:Building gml:id="b"><bldg:lod1TerrainIntersection><gml:MultiCurve>'
            f"<gml:curveMember>{line}</gml:curveMember></gml:MultiCurve>"
            "</bldg:lod1TerrainIntersection></bldg:Building>"
        ]
    ).objects

    (curve,) = building.curves["lod1TerrainIntersectionCurve"]
    assert curve.tolist() == CORNERS[:2].tolist()


def test_references_that_multiply_are_refused(read):
    """Each surface refers ten times to the next; the last refers to the first."""
    chain = "".join(
        f'<bldg:lod2MultiSurface><gml:MultiSurface gml:id="m{k}">'
        f"{reference(f'm{(k + 1) % 9}') * 10}</gml:MultiSurface></bldg:lod2MultiSurface>"
        for k in range(9)
    )
    with pytest.raises(EnvgenError, match="multiply"):
        read([f'<bldg:Building gml:id="b">{chain}</bldg:Building>'])


def test_a_value_that_is_not_of_its_type_stays_a_text(read):
    city = read(
        [
            '<bldg:Building gml:id="b"><gen:intAttribute name="age"><gen:value>old</gen:value>'
            "</gen:intAttribute><bldg:storeysAboveGround>two</bldg:storeysAboveGround>"
            "</bldg:Building>"
        ]
    )

    assert city.objects[0].attributes == {"storeysAboveGround": "two", "age": "old"}
    assert [issue.kind for issue in city.issues] == ["city.attribute"] * 2
    assert "'two' is no value of storeysAboveGround" in {issue.message for issue in city.issues}


def test_our_own_2_0_in_a_crs_that_no_registry_knows(tmp_path):
    crs = "+proj=tmerc +lat_0=49 +lon_0=8 +x_0=0 +y_0=0 +datum=WGS84 +units=m"
    ring = Polygons.of_rings([CORNERS[FACES["GroundSurface"]]])
    use = CityObject("l", "LandUse", geometry={"lod2MultiSurface": ring})
    path = tmp_path / "city.gml"
    write_city(City((use,), crs, (250000.0, 130000.0, 0.0)), path, version="2.0")

    city = read_city(path)

    assert (city.crs, city.offset) == (crs, (250000.0, 130000.0, 0.0))
    found = city.objects[0].geometry["lod2MultiSurface"]
    np.testing.assert_array_equal(found.points, ring.points)


def test_our_own_file_reads_the_same_as_that_of_another_program(tmp_path, difference):
    faces = {kind: CORNERS[ring] for kind, ring in FACES.items()}
    building = CityObject(
        "b",
        "Building",
        {"height": 6.0, "note": "x"},
        tuple(
            ThematicSurface(
                f"b_{kind}", kind.rstrip("234"), Polygons.of_rings([ring]), 2, "plaster"
            )
            for kind, ring in faces.items()
        ),
        solid_lod=2,
        geometry={"lod1Solid": Polygons.of_rings(list(faces.values()))},
    )
    pose = Placement(np.array([1.0, 2, 3]), 0.5, np.array([2.0, 2, 9]), "tree", 0.25, -0.125)
    tree = CityObject("t", "SolitaryVegetationObject", placement=pose)
    write_city(City((building, tree)), tmp_path / "city.gml")

    own = read_city(tmp_path / "city.gml")

    assert difference(own, read_foreign(tmp_path / "city.gml")) is None
    assert own.objects[1].placement.size.tolist() == [2, 2, 9]


def test_surfaces_of_extensions_have_the_class_that_they_extend(shared):
    city = read_city(shared / "citymodels" / "test_ade_objects_v3.gml")

    kinds = {surface.kind for each in city.walk() for surface in each.surfaces}

    assert "RoofSurface" in kinds
    assert not [kind for kind in kinds if "Solar" in kind]
