"""The side of traffic: tags, roundabouts, carriageways, places; and the mirror image of streets."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.places.places_extracts import Extract, crossing

from envgen_usd.errors import EnvgenError
from envgen_usd.places.driving_side import left_hand_reason
from envgen_usd.places.mirrored_streets import mirrored_extract, mirrored_plan, mirrored_tags
from envgen_usd.places.osm_streets import read_street_extract
from envgen_usd.places.street_chains import street_plan
from envgen_usd.places.street_tags import read_profile


def read(extract, tmp_path):
    return read_street_extract(extract.write(tmp_path / "place.osm"))


def moved(extract, lon, lat):
    """The same streets at another place on Earth."""
    return replace(extract, bounds=(lon, lat, lon + 0.01, lat + 0.01))


def roundabout(turn):
    extract = Extract()
    angles = turn * np.linspace(0.0, 2 * np.pi, 17)[:-1]
    ring = [(round(15 * np.cos(a), 3), round(15 * np.sin(a), 3)) for a in angles]
    extract.way(*ring, ring[0], highway="residential", junction="roundabout")
    extract.way(ring[0], (80.0, 0.0), highway="residential")
    return extract


def dual_carriageway(side):
    """Opposite traffic on the left (1) or on the right (-1)."""
    extract = Extract()
    extract.way((0.0, 0.0), (200.0, 0.0), highway="primary", oneway="yes")
    extract.way((200.0, 12.0 * side), (0.0, 12.0 * side), highway="primary", oneway="yes")
    return extract


@pytest.mark.parametrize(
    ("extract", "is_left"),
    [
        (crossing(), False),
        (crossing(driving_side="left"), True),
        (roundabout(1), False),
        (roundabout(-1), True),
        (dual_carriageway(1), False),
        (dual_carriageway(-1), True),
    ],
    ids=["nothing", "tag", "ccw", "cw", "left", "right"],
)
def test_the_map_says_where_traffic_drives(extract, is_left, tmp_path):
    found = read(extract, tmp_path)
    assert bool(left_hand_reason(found)) is is_left
    assert not left_hand_reason(found, "right")
    assert left_hand_reason(found, "left")


@pytest.mark.parametrize(
    ("place", "is_left"),
    [
        ((-0.12, 51.5), True),  # London
        ((-6.26, 53.35), True),  # Dublin
        ((1.85, 50.95), False),  # Calais
        ((-1.62, 49.64), False),  # Cherbourg
        ((139.7, 35.7), True),  # Tokyo
        ((141.35, 43.06), True),  # Sapporo
        ((129.0, 35.2), False),  # Busan
        ((131.9, 43.1), False),  # Vladivostok
        ((151.2, -33.9), True),  # Sydney
        ((174.8, -36.9), True),  # Auckland
        ((28.0, -26.2), True),  # Johannesburg
        ((77.2, 28.6), False),  # Delhi: its streets decide
        ((72.8, 19.1), True),  # Mumbai
        ((100.5, 13.7), True),  # Bangkok
        ((103.8, 1.3), True),  # Singapore
        ((106.8, -6.2), True),  # Jakarta
        ((104.9, 11.6), False),  # Phnom Penh
        ((114.1, 22.55), False),  # Shenzhen
        ((114.16, 22.3), True),  # Hong Kong
        ((2.35, 48.85), False),  # Paris
        ((13.2, -8.8), False),  # Luanda
        ((30.1, -1.95), False),  # Kigali
    ],
)
def test_the_country_decides_where_the_map_does_not(place, is_left, tmp_path):
    assert bool(left_hand_reason(moved(read(crossing(), tmp_path), *place))) is is_left


def test_streets_count_more_than_the_country(tmp_path):
    assert not left_hand_reason(moved(read(roundabout(1), tmp_path), -0.1, 51.5))


def test_an_unknown_side_is_refused(tmp_path):
    with pytest.raises(EnvgenError, match="--driving-side middle: unknown"):
        left_hand_reason(read(crossing(), tmp_path), "middle")


_TAGS = st.dictionaries(
    st.sampled_from(
        ["turn:lanes:forward", "sidewalk", "sidewalk:left:width", "parking:right", "cycleway:left",
         "placement:forward", "name", "change:lanes", "lanes:forward", "parking:left:orientation"]
    ),
    st.sampled_from(
        ["left|through;slight_right|", "both", "right", "left_of:2", "middle_of:-1", "Leftwich",
         "2", "not_left|yes"]
    ),
)  # fmt: skip


@given(_TAGS)
def test_the_image_of_an_image_is_the_original(tags):
    assert mirrored_tags(mirrored_tags(tags)) == tags


def test_tags_change_sides_and_names_do_not():
    assert mirrored_tags(
        {
            "turn:lanes": "left|through;slight_right",
            "sidewalk": "left",
            "cycleway:right": "lane",
            "name": "Right Bank",
            "placement": "right_of:1",
            "width:lanes": "3|3.5",
        }
    ) == {
        "turn:lanes": "through;slight_left|right",
        "sidewalk": "right",
        "cycleway:left": "lane",
        "name": "Right Bank",
        "placement": "left_of:-1",
        "width:lanes": "3.5|3",
    }


def test_the_plan_of_the_image_is_the_image_of_the_plan(tmp_path):
    extract = crossing(turn__lanes__forward="left|right", lanes="3", sidewalk="left")
    extract.node(60.0, 4.0, natural="tree")
    extract.way((20, 20), (30, 20), (30, 30), (20, 30), (20, 20), building="house")
    found = read(extract, tmp_path)
    plan = street_plan(found, tmp_path / "place.osm")
    image = mirrored_plan(street_plan(mirrored_extract(found), tmp_path / "place.osm"))
    assert image.crs == plan.crs
    assert len(image.streets) == len(plan.streets)
    for street, other in zip(plan.streets, image.streets, strict=True):
        assert np.allclose(street.line, other.line, atol=1e-6)
    assert np.allclose(plan.points[0].place, image.points[0].place, atol=1e-6)
    # The image keeps right: its traffic ahead lies on the other side, and turns the other way.
    ahead = read_profile(mirrored_tags(found.ways[0].tags)).profile
    assert [lane.turns for lane in ahead.right[:2]] == [{"left"}, {"right"}]
    assert ahead.right[-1].kind == "sidewalk"
