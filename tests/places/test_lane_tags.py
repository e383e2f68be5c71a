"""Tags of single lanes: widths, changes, and where the line of the way lies."""

import pytest

from envgen_usd.places.street_tags import read_profile


def profile_of(**tags):
    tags = {"highway": "primary", **{k.replace("__", ":"): v for k, v in tags.items()}}
    return read_profile(tags)


def test_lanes_have_their_widths_from_the_middle_outwards():
    read = profile_of(
        lanes="4", lanes__forward="3", width__lanes__forward="3.0|3.25|4 m",
        width__lanes__backward="2,75",
    )  # fmt: skip
    assert [lane.width for lane in read.profile.right[:3]] == [3.0, 3.25, 4.0]
    assert read.profile.left[0].width == 2.75
    assert not read.faults


@pytest.mark.parametrize("value", ["3|3", "3|3|400", "3|x|3"])
def test_widths_that_fit_no_lane_are_faults(value):
    read = profile_of(oneway="yes", lanes="3", width__lanes=value)
    assert read.faults == ("width:lanes",)
    assert all(2.0 <= lane.width <= 5.5 for lane in read.profile.right[:3])


@pytest.mark.parametrize(
    ("value", "stays"),
    [
        ("yes|yes", [set(), set()]),
        ("no|no", [{"left", "right"}] * 2),
        ("not_right|yes", [{"right"}, set()]),
        ("only_right|only_left", [{"left"}, {"right"}]),
    ],
)
def test_changes_of_lanes(value, stays):
    read = profile_of(oneway="yes", lanes="2", change__lanes=value)
    assert [lane.stays for lane in read.profile.right[:2]] == stays


@pytest.mark.parametrize(
    ("tags", "line"),
    [
        ({"oneway": "yes", "placement": "right_of:1"}, ("right", 1.0)),
        ({"oneway": "yes", "placement": "left_of:1"}, ("right", 0.0)),
        ({"oneway": "yes", "placement": "middle_of:3"}, ("right", 2.5)),
        ({"oneway": "yes", "placement": "left_of:-1"}, ("right", 2.0)),
        ({"oneway": "-1", "placement": "right_of:1"}, ("left", 1.0)),
        ({"lanes:forward": "2", "placement:forward": "right_of:2"}, ("right", 2.0)),
        ({"lanes:forward": "2", "placement:backward": "middle_of:1"}, ("left", 0.5)),
        ({"oneway": "yes", "placement": "transition"}, ("transition", 0.0)),
        ({"oneway": "yes"}, None),
    ],
)
def test_the_line_of_a_way_lies_where_placement_says(tags, line):
    read = read_profile({"highway": "primary", "lanes": "3", **tags})
    assert read.profile.line == line
    assert not read.faults
    back = read.profile.reversed().line
    assert back == (line and ({"left": "right", "right": "left"}.get(line[0], line[0]), line[1]))


@pytest.mark.parametrize("value", ["right_of:4", "left_of:0", "between:1", "99"])
def test_a_place_beyond_the_lanes_is_a_fault(value):
    read = profile_of(oneway="yes", lanes="3", placement=value)
    assert (read.profile.line, read.faults) == (None, ("placement",))


def test_markings():
    assert not profile_of(lanes="2", lane_markings="no").profile.marked
    assert profile_of(lanes="2").profile.marked
    street = read_profile({"highway": "residential", "lane_markings": "yes"}).profile
    assert street.lined
    assert not read_profile({"highway": "residential"}).profile.lined
