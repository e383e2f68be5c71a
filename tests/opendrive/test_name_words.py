"""Names of models tell what an object is by whole words, not by letters within them."""

import pytest

from envgen_usd.opendrive.features.name_words import Vocabulary, words_of
from envgen_usd.opendrive.features.object_kinds import FLAT, UNKNOWN, kind_of


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("CoulPine_Lg01", "coul pine lg 01"),
        ("SgRMArrowLeft", "sg rm arrow left"),
        ("Downtown_30mX30m_2storey", "downtown 30 m x 30 m 2 storey"),
        ("guide-post", "guide post"),
        ("STOP", "stop"),
        ("GrüneÄsteÉtude", "grüne äste étude"),
        (" -1 ", "1"),
        ("", ""),
    ],
)
def test_words(name, words):
    assert words_of(name) == tuple(words.split())


def test_phrases_are_whole_words_joined_or_not():
    vocabulary = Vocabulary([(1, ("street lamp", "box")), (2, ("speed #", "solid * white"))])
    for name in ("StreetLamp_3", "old street-lamps", "streetlamp", "two boxes"):
        assert vocabulary.meaning(name) == 1
    for name in ("Speed_30", "SolidWhite", "solid_very_broad_white"):
        assert vocabulary.meaning(name) == 2
    for name in ("StreetClamp", "street_of_lamps", "boxer", "speed", "solidarity_white", ""):
        assert vocabulary.meaning(name) is None


@pytest.fixture
def template(network_of, road_xml):
    """Template of an object of a type, subtype and name."""

    def of(type_, subtype, name):
        what = f'type="{type_}" subtype="{subtype}" name="{name}"'
        rest = f'<objects><object id="1" s="5" t="8" zOffset="0" hdg="0" {what}/></objects>'
        return kind_of(network_of(road_xml(rest=rest)).roads["1"].objects[0]).template

    return of


@pytest.mark.parametrize("name", ["street_cabinet", "soak_pit", "HelmetStand", "Spine_01"])
def test_letters_within_words_make_no_trees(template, name):
    assert template("obstacle", "", name) == "obstacle"
    assert template("pole", "", name) == "pole"
    assert template("-1", "", name) == UNKNOWN


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Trash01", "bin"),
        ("ClampRack", UNKNOWN),
        ("LogCabin", UNKNOWN),
        ("Falconer", UNKNOWN),
        ("Ambush", UNKNOWN),
        ("carpet_roll", UNKNOWN),
        ("Window_Pane", UNKNOWN),
        ("TrampolinePark", UNKNOWN),
        ("Bike_Rack", UNKNOWN),
        ("tree_pit", UNKNOWN),
        ("OakBench", "bench"),
        ("bus_shelter", "bus_stop"),
        ("Ash01", "tree"),
        ("pinetree_3", "tree"),
        ("Maples", "tree"),
        ("Warehouse_B", "building"),
        ("10storey", "building"),
        ("RdTrafficLightPole01", "pole"),
        ("Speed_30", "traffic_sign"),
        ("Sign_TreeAhead", "traffic_sign"),
        ("SolidSingleWhite", FLAT),
        ("ParkingSpace3", FLAT),
        ("Car_Red", "vehicle"),
        ("parkingspace", FLAT),
        ("models/guide-post.osgb", "delineator"),
    ],
)
def test_kinds_by_name(template, name, expected):
    assert template("none", "", name) == expected


def test_subtypes_tell_more_than_names(template):
    assert template("obstacle", "trashBin", "HelmetStand") == "bin"
    assert template("obstacle", "clampBar", "x") == "obstacle"
    assert template("vegetation", "", "VegBush06") == "bush"
