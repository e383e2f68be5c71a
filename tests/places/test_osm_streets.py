"""Streets of extracts: tags against the wiki's meaning, chains and borders against geometry."""

import numpy as np
import pytest
from tests.places.places_extracts import Extract, crossing, degrees

from envgen_usd.errors import EnvgenError
from envgen_usd.places.osm_signs import sign_codes
from envgen_usd.places.osm_streets import area_of, read_street_extract
from envgen_usd.places.osm_tags import line_kind
from envgen_usd.places.street_chains import street_plan
from envgen_usd.places.street_tags import Surroundings, read_profile


def profile(**tags):
    """Cross-section of a residential street in a town."""
    tags = {key.replace("__", ":"): value for key, value in tags.items()}
    return read_profile({"highway": "residential", **tags}).profile


def kinds(lanes):
    return [lane.kind for lane in lanes]


def plan_of(extract, tmp_path, bounds=None, max_area=25.0):
    path = extract.write(tmp_path / "place.osm")
    return street_plan(read_street_extract(path, bounds, max_area), path, "1")


@pytest.mark.parametrize(
    ("tags", "left", "right"),
    [
        ({}, 1, 1),
        ({"lanes": "4"}, 2, 2),
        ({"lanes": "3"}, 1, 2),
        ({"lanes": "3", "lanes__backward": "2"}, 2, 1),
        ({"lanes__forward": "3", "lanes__backward": "1"}, 1, 3),
        ({"oneway": "yes", "lanes": "2"}, 0, 2),
        ({"oneway": "-1", "lanes": "2"}, 2, 0),
        ({"junction": "roundabout"}, 0, 1),
        ({"highway": "motorway"}, 0, 2),
        ({"oneway": "yes", "turn__lanes": "left|through|through;right"}, 0, 3),
        ({"lanes": "1000000"}, 1, 1),
        ({"lanes": "nan"}, 1, 1),
    ],
)
def test_lanes_follow_their_tags(tags, left, right):
    found = profile(**tags)
    assert (found.driving("left"), found.driving("right")) == (left, right)
    assert not found.shared


def test_the_only_lane_of_a_two_way_street_serves_both_directions():
    found = profile(lanes="1")
    assert found.shared
    assert (found.driving("left"), found.driving("right")) == (0, 1)


def test_turns_are_given_from_the_middle_outwards():
    found = profile(oneway="yes", turn__lanes="left|through|through;right")
    lanes = [lane.turns for lane in found.right if lane.kind == "driving"]
    assert lanes == [{"left"}, {"through"}, {"through", "right"}]
    back = profile(lanes="3", lanes__backward="2", turn__lanes__backward="left|right")
    assert [lane.turns for lane in back.left if lane.kind == "driving"] == [{"left"}, {"right"}]


def test_what_lies_beside_the_lanes_has_its_side_and_order():
    found = profile(
        cycleway__right="lane",
        parking__both="lane",
        parking__left__orientation="perpendicular",
        sidewalk="left",
    )
    assert kinds(found.right) == ["driving", "biking", "parking"]
    assert kinds(found.left) == ["driving", "parking", "sidewalk"]
    assert found.left[1].width == 5.0
    assert found.right[2].width == 2.0
    track = profile(cycleway="track", sidewalk="both")
    assert kinds(track.left) == ["driving", "biking", "sidewalk"]
    assert track.left[1].raised


def test_a_width_is_shared_by_the_lanes_without_parking():
    found = profile(width="10", parking__both="lane", sidewalk="no")
    driving = [lane.width for lane in (*found.left, *found.right) if lane.kind == "driving"]
    assert driving == [3.0, 3.0]
    assert sum(lane.width for lane in (*found.left, *found.right)) == 10.0


@pytest.mark.parametrize(
    ("tag", "value"), [("width", "400"), ("width", "NaN"), ("lanes", "1000000"), ("lanes", "-3")]
)
def test_hostile_values_are_named_and_the_class_counts(tag, value):
    read = read_profile({"highway": "residential", tag: value})
    assert read.faults == (tag,)
    assert read.profile == read_profile({"highway": "residential"}).profile


@pytest.mark.parametrize(
    ("tags", "around", "widths"),
    [
        ({}, Surroundings(), {"left": [2.25], "right": [2.25, 2.0]}),
        ({}, Surroundings(free_left=9.0, free_right=8.0), {"left": [2.25, 2.0], "right": [2.25]}),
        ({"oneway": "yes"}, Surroundings(), {"left": [], "right": [3.5, 2.0]}),
        # No room, no houses, another class, or tags that tell the cross-section.
        ({}, Surroundings(free_right=5.0), {"left": [2.75], "right": [2.75]}),
        ({}, Surroundings(town=False), {"left": [2.75], "right": [2.75]}),
        ({"highway": "unclassified"}, Surroundings(), {"left": [2.75], "right": [2.75]}),
        ({"lanes": "2"}, Surroundings(), {"left": [2.75], "right": [2.75]}),
        ({"parking:both": "no"}, Surroundings(), {"left": [2.75], "right": [2.75]}),
        ({"bridge": "yes"}, Surroundings(), {"left": [2.75], "right": [2.75]}),
    ],
)
def test_vehicles_park_on_streets_between_houses_that_no_tag_describes(tags, around, widths):
    found = read_profile({"highway": "residential", **tags}, around).profile
    for side, expected in widths.items():
        lanes = [lane for lane in getattr(found, side) if lane.kind != "sidewalk"]
        assert [lane.width for lane in lanes] == expected
        assert [lane.kind for lane in lanes] == ["driving", "parking"][: len(lanes)]
    # RASt 06, 6.1.1.2: carriageways with traffic both ways are 4.5 to 6.5 m wide.
    total = sum(sum(each) for each in widths.values())
    assert 4.5 <= total <= 6.5


def test_sidewalks_end_before_walls():
    tags = {"highway": "residential", "sidewalk": "both", "parking:both": "no"}
    half = read_profile(tags).profile.right[0].width
    found = read_profile(tags, Surroundings(free_right=half + 1.5, free_left=half + 0.6)).profile
    assert found.right[-1].width == pytest.approx(1.2)
    assert kinds(found.left) == ["driving"]


def test_streets_end_where_several_meet(tmp_path):
    extract = crossing()
    extract.way((100.0, 0.0), (150.0, 20.0), highway="residential", lanes="4", sidewalk="both")
    plan = plan_of(extract, tmp_path)
    assert len(plan.nodes) == 5
    assert len(plan.streets) == 4
    lengths = sorted(street.length for street in plan.streets)
    assert lengths == pytest.approx([100.0] * 3 + [100.0 + np.hypot(50.0, 20.0)], rel=2e-3)
    # The longer one has two cross-sections in a single chain.
    longest = max(plan.streets, key=lambda street: street.length)
    assert sorted(p.driving("right") + p.driving("left") for p in longest.profiles) == [2, 4]


def test_one_way_streets_run_with_their_traffic(tmp_path):
    extract = Extract()
    extract.way((0.0, 0.0), (100.0, 0.0), highway="residential", oneway="-1")
    (street,) = plan_of(extract, tmp_path).streets
    assert street.line[0, 0] > street.line[-1, 0]
    assert street.profiles[0].driving("left") == 0
    assert street.profiles[0].driving("right") == 1


def test_a_box_cuts_streets_at_its_border(tmp_path):
    (south, west), (north, east) = degrees(-60.0, -30.0), degrees(40.0, 30.0)
    plan = plan_of(crossing(), tmp_path, (west, south, east, north))
    lengths = sorted(street.length for street in plan.streets)
    assert lengths == pytest.approx([30.0, 30.0, 40.0, 60.0], rel=2e-3)


def test_only_turns_ban_all_others_at_their_node(tmp_path):
    extract = crossing()
    first, other = 1000, 1001
    node = extract.node(0.0, 0.0)
    members = [("way", first, "from"), ("node", node, "via"), ("way", first, "to")]
    extract.relation(members, type="restriction", restriction="only_straight_on")
    plan = plan_of(extract, tmp_path)
    assert {(a, b) for a, _, b in plan.banned} == {(first, other)}


def test_missing_nodes_are_counted_and_the_rest_is_used(tmp_path):
    extract = crossing()
    text = extract.text().replace(f'<nd ref="{extract.node(100.0, 0.0)}"/>', '<nd ref="999999"/>')
    path = tmp_path / "cut.osm"
    path.write_text(text)
    plan = street_plan(read_street_extract(path), path)
    assert [issue.kind for issue in plan.issues] == ["osm.incomplete_way"]
    assert len(plan.streets) == 3


def test_extracts_that_cannot_be_used_are_refused(tmp_path):
    empty = Extract()
    empty.way((0.0, 0.0), (10.0, 0.0), highway="footway")
    with pytest.raises(EnvgenError, match="no street for motor vehicles"):
        read_street_extract(empty.write(tmp_path / "empty.osm"))
    with pytest.raises(EnvgenError, match="no such file"):
        read_street_extract(tmp_path / "none.osm")
    (tmp_path / "text.osm").write_text("no map")
    with pytest.raises(EnvgenError, match="cannot be read as an OpenStreetMap extract"):
        read_street_extract(tmp_path / "text.osm")
    with pytest.raises(EnvgenError, match=r"--max-area 0\.01"):
        read_street_extract(crossing().write(tmp_path / "wide.osm"), None, 0.01)
    text = crossing().text().replace('lon="10.99', 'lon="-179.99')
    (tmp_path / "date.osm").write_text(text)
    with pytest.raises(EnvgenError, match="date line"):
        read_street_extract(tmp_path / "date.osm")


def test_the_area_of_a_box_is_that_of_a_sphere():
    assert area_of((-180.0, -90.0, 180.0, 90.0)) == pytest.approx(4 * np.pi * 6371.0**2)
    assert area_of((11.0, 48.0, 11.01, 48.01)) == pytest.approx(0.827, rel=2e-3)


@pytest.mark.parametrize(
    ("said", "codes"),
    [
        ("DE:274[50]", ["DE:274-50"]),
        ("DE:262:18", ["DE:262-18"]),
        ("DE:240,DE:1022-11", ["DE:240"]),
        ("DE:260;DE:1026-37", ["DE:260"]),
        ("city_limit", ["DE:310"]),
        ("maxspeed", ["DE:274-30"]),
        ("nonsense", []),
        ("", []),
    ],
)
def test_signs_are_named_by_country_and_number(said, codes):
    assert sign_codes({"traffic_sign": said, "maxspeed": "30"}) == codes


def test_rows_of_trees_and_barriers_are_read_with_their_heights(tmp_path):
    extract = crossing()
    extract.way((10.0, 30.0), (50.0, 30.0), natural="tree_row")
    extract.way((10.0, 40.0), (50.0, 40.0), barrier="fence", height="1.8 m")
    extract.way((10.0, 50.0), (50.0, 50.0), barrier="hedge", height="banana")
    plan = plan_of(extract, tmp_path)
    places = np.array([point.place for point in plan.points if point.kind == "tree"])
    # Six trees of 8 m spacing on 40 m.
    assert len(places) == 6
    assert np.ptp(places[:, 1]) < 0.1
    assert np.ptp(places[:, 0]) == pytest.approx(40.0, abs=0.1)
    assert [line.kind for line in plan.lines] == ["fence", "hedge"]
    assert plan.lines[0].height == pytest.approx(1.8)
    assert np.isnan(plan.lines[1].height)


@pytest.mark.parametrize(
    ("tags", "kind"),
    [
        ({"railway": "rail"}, "rail"),
        ({"railway": "tram", "tunnel": "yes"}, ""),
        ({"railway": "rail", "bridge": "yes"}, ""),
        ({"railway": "subway"}, ""),
        ({"barrier": "retaining_wall"}, "wall"),
        ({"barrier": "chain"}, ""),
    ],
)
def test_lines_on_the_land_are_taken(tags, kind):
    assert line_kind(tags) == kind
