"""What objects and signals of a road file are as features of CityGML."""

import numpy as np
import pytest

from envgen_usd.city.roads.file_objects import file_object
from envgen_usd.citygml.implicit_pose import rotation
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.reader import read_network

ROAD = """<OpenDRIVE><header revMajor="1" revMinor="8"/>
  <road name="" id="1" length="100" junction="-1">
  <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
  <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
  </laneSection></lanes>{}</road></OpenDRIVE>"""
SQUARE = "".join(
    f'<cornerLocal u="{u}" v="{v}" z="0" height="8"/>' for u, v in ((0, 0), (4, 0), (4, 3))
)
OUTLINE = f"<outlines><outline id='0' closed='true'>{SQUARE}</outline></outlines>"
RAIL = '<repeat s="10" length="20" distance="0" tStart="5" tEnd="5"/>'


@pytest.fixture
def features_of(tmp_path):
    """Features of the city for the objects and signals of a road of 100 m to the east."""

    def read(rest):
        path = tmp_path / "map.xodr"
        path.write_text(ROAD.format(rest))
        return [file_object(feature) for feature in road_features(read_network(path))]

    return read


@pytest.fixture
def object_of(features_of):
    def read(type_, inner="", **more):
        values = {"id": "7", "s": 20, "t": 9, "zOffset": 0, "hdg": 0} | more
        attributes = " ".join(f'{name}="{value}"' for name, value in values.items())
        text = f'<object type="{type_}" {attributes}>{inner}</object>'
        (feature,) = features_of(f"<objects>{text}</objects>")
        return feature

    return read


@pytest.mark.parametrize(
    ("type_", "inner", "class_", "function"),
    [
        ("pole", "", "CityFurniture", "1270"),
        ("pole|trafficLight", "", "CityFurniture", "1080"),
        ("pole|trafficSign", "", "CityFurniture", "1070"),
        ("pole|streetLamp", "", "CityFurniture", "1150"),
        ("pole|permanentDelineator", "", "CityFurniture", "1320"),
        ("pole|emergencyCallBox", "", "CityFurniture", "1030"),
        ("obstacle|hydrant", "", "CityFurniture", "1330"),
        ("obstacle|controllerBox", "", "CityFurniture", "1060"),
        ("obstacle|trashBin", "", "CityFurniture", "1200"),
        ("obstacle|bench", "", "CityFurniture", None),
        ("busStop", "", "CityFurniture", "1110"),
        ("obstacle", OUTLINE, "CityFurniture", None),
        ("gantry", OUTLINE, "CityFurniture", "1270"),
        ("barrier", RAIL, "CityFurniture", "1440"),
        ("barrier|guardRail", RAIL, "CityFurniture", "1440"),
        ("barrier|jerseyBarrier", RAIL, "CityFurniture", "1440"),
        ("barrier|fence", RAIL, "CityFurniture", "1440"),
        ("barrier|wall", RAIL, "CityFurniture", None),
        ("barrier|noiseProtection", RAIL, "CityFurniture", None),
        ("barrier|hedge", RAIL, "PlantCover", None),
        ("tree", "", "SolitaryVegetationObject", None),
        ("vegetation|bush", "", "SolitaryVegetationObject", None),
        ("vegetation|bush", OUTLINE, "PlantCover", None),
        ("none", OUTLINE, "GenericOccupiedSpace", None),
        ("monument", "", "GenericOccupiedSpace", None),
        ("barrier", "", "CityFurniture", "1440"),
        ("railing", "", "CityFurniture", "1440"),
        ("soundBarrier", "", "CityFurniture", None),
    ],
)
def test_classes_and_functions(object_of, type_, inner, class_, function):
    """Functions are those of the SIG3D code list for ``CityFurniture``."""
    type_, _, subtype = type_.partition("|")
    feature = object_of(type_, inner, subtype=subtype)
    assert feature.kind == class_
    assert feature.attributes.get("function") == function
    assert feature.attributes.get("class") == (None if function is None else "1000")


def test_a_tree_has_its_height_its_crown_and_what_the_file_calls_it(object_of):
    tree = object_of("tree", height=7, radius=1.5, name="oak", subtype="leafTree")
    assert tree.attributes == {
        **{"height": 7, "crownDiameter": 3, "opendrive_id": "7", "opendrive_name": "oak"},
        **{"opendrive_type": "tree", "opendrive_subtype": "leafTree", "opendrive_road": "1"},
    }
    np.testing.assert_allclose(tree.placement.size, [3, 3, 7])
    assert tree.placement.template == "tree"
    assert (tree.geometry, tree.surfaces, tree.relations) == ({}, (), {})


@pytest.mark.parametrize(
    ("name", "side", "leans"),
    [
        ("pitch", (1, 0, 0), (np.cos(0.3), 0, -np.sin(0.3))),
        ("roll", (0, 1, 0), (0, np.cos(0.3), np.sin(0.3))),
    ],
)
def test_a_turned_object_leans_where_opendrive_turns_it(object_of, name, side, leans):
    """13.1: turns are right-handed about y and x, so that pitch lowers the front."""
    place = object_of("pole", **{name: 0.3}).placement
    turned = rotation(place.heading, place.pitch, place.roll)
    np.testing.assert_allclose(turned @ side, leans, atol=1e-9)


def test_a_building_has_semantic_surfaces(object_of):
    house = object_of("building", OUTLINE)
    assert (house.kind, house.solid_lod) == ("Building", 2)
    facts = {"class": "1000", "roofType": "1000", "storeysAboveGround": 3, "height": 8}
    origin = {"opendrive_id": "7", "opendrive_type": "building", "opendrive_road": "1"}
    assert house.attributes == facts | origin
    assert [(each.id, each.kind, each.material, len(each.polygons)) for each in house.surfaces] == [
        ("object_1_0_0_wall_0", "WallSurface", "plaster", 1),
        ("object_1_0_0_wall_1", "WallSurface", "plaster", 1),
        ("object_1_0_0_wall_2", "WallSurface", "plaster", 1),
        ("object_1_0_0_roof", "RoofSurface", "bitumen", 1),
        ("object_1_0_0_ground", "GroundSurface", "concrete", 1),
    ]
    heights = [sorted(set(each.polygons.points[:, 2].tolist())) for each in house.surfaces]
    assert heights == [[0, 8], [0, 8], [0, 8], [8], [0]]
    rings = [each.polygons.rings(0)[0].tolist() for each in house.surfaces]
    edges = [(a, b) for ring in rings for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    assert sorted(edges) == sorted((b, a) for a, b in edges)


@pytest.mark.parametrize(
    ("subtype", "template", "material"),
    [
        ("guardRail", "guard_rail", "metal_galvanised"),
        ("railing", "railing", "metal_galvanised"),
        ("fence", "fence", "metal_galvanised"),
        ("jerseyBarrier", "jersey", "concrete"),
        ("wall", "wall", "concrete"),
        ("hedge", "hedge", "hedge_privet"),
    ],
)
def test_a_barrier_has_its_cross_section_and_its_material(object_of, subtype, template, material):
    rail = object_of("barrier", RAIL, subtype=subtype)
    assert (rail.attributes["template"], rail.attributes["material"]) == (template, material)
    assert list(rail.geometry) == ["lod2MultiSurface"]
    assert rail.placement is None


def test_a_sign_has_its_face_and_what_the_file_says_of_it(features_of):
    (sign,) = features_of(
        """<signals><signal id="s" name="give way" s="50" t="-6" zOffset="2" orientation="+"
        dynamic="no" country="DE" type="205" subtype="-1" value="30" unit="m" text="30 m"
        width="0.8" height="0.7"/></signals>"""
    )
    assert sign.kind == "CityFurniture"
    assert sign.attributes == {
        **{"class": "1000", "function": "1070", "shape": "triangle"},
        **{"sign_shape": "inverted_triangle", "face_lower_edge": 2},
        **{"face_width": 0.8, "face_height": 0.7, "opendrive_id": "s"},
        "opendrive_road": "1",
        **{"opendrive_name": "give way", "opendrive_type": "205", "opendrive_subtype": "-1"},
        **{"opendrive_country": "DE", "opendrive_orientation": "+", "opendrive_dynamic": "no"},
        **{"opendrive_text": "30 m", "opendrive_unit": "m", "opendrive_value": 30},
    }
    assert sign.relations == {"controls": ("road_1_s0_lane_-1",)}
    np.testing.assert_allclose(sign.placement.size, [0, 0.8, 2.7])
    np.testing.assert_allclose(sign.placement.position, [50, -6, 0])


@pytest.mark.parametrize(
    ("code", "shape", "variant"),
    [
        ("101", "triangle", "triangle"),
        ("201", "cross", "square"),
        ("206", "octagon", "octagon"),
        ("274", "round", "round"),
        ("306", "diamond", "square"),
        ("330", "square", "square"),
        ("432", "rectangle", "square"),
    ],
)
def test_a_sign_has_its_shape_and_the_nearest_that_an_asset_has(features_of, code, shape, variant):
    (sign,) = features_of(
        f"""<signals><signal id="s" s="50" t="-6" orientation="+" dynamic="no" country="DE"
        type="{code}"/></signals>"""
    )
    assert (sign.attributes["sign_shape"], sign.attributes["shape"]) == (shape, variant)


def test_a_light_has_no_shape_and_depends_on_other_signals(features_of):
    light, other = features_of(
        """<signals><signal id="a" s="50" t="-6" orientation="+" dynamic="yes" type="1000001"
        country="OpenDRIVE"><dependency id="b"/></signal>
        <signal id="b" s="60" t="-6" orientation="+" dynamic="no" type="206" country="DE"/>
        </signals>"""
    )
    assert light.attributes["function"] == "1080"
    assert light.attributes["opendrive_dynamic"] == "yes"
    assert not {"shape", "sign_shape", "opendrive_value", "opendrive_text"} & set(light.attributes)
    assert other.id in light.relations["dependsOn"]
    assert "dependsOn" not in other.relations
    assert other.attributes["shape"] == "octagon"
