"""Streets of a map as OpenDRIVE, read back and held against the map's geometry."""

import numpy as np
import pytest
import shapely
from lxml import etree
from tests.places.places_extracts import Extract, crossing, degrees
from tests.streets.lane_gaps import lane_gaps

from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.rounded_lines import rounded_line
from envgen_usd.places.osm_streets import read_street_extract
from envgen_usd.places.street_chains import street_plan
from envgen_usd.recipe.map_land import read_road
from envgen_usd.streets.mapped_roads import mapped_roads
from envgen_usd.streets.street_ties import CLEARANCE

STREET = {"highway": "residential", "sidewalk": "both"}


def roads_of(extract, tmp_path, ground=None):
    """The plan, the file as XML, its reading and its surface."""
    path = extract.write(tmp_path / "place.osm")
    plan = street_plan(read_street_extract(path), path, "1")
    made = mapped_roads(plan, "place", ground)
    file = tmp_path / "road.xodr"
    file.write_bytes(made.xml)
    reading, surface = read_road(file, 0.02, read_profile("1", "residential").road)
    return plan, etree.fromstring(made.xml), reading, surface


@pytest.mark.parametrize("rest", [0.001, 0.1, 0.4, 0.6, 1.9])
def test_a_box_leaves_a_street_of_any_length(tmp_path, rest):
    """East of a crossing the box ends: what is left of the street is too short for a road."""
    path = crossing().write(tmp_path / "place.osm")
    (south, west), (north, east) = degrees(-60.0, -30.0), degrees(rest, 30.0)
    extract = read_street_extract(path, (west, south, east, north))
    made = mapped_roads(street_plan(extract, path, "1"), "place")
    (tmp_path / "road.xodr").write_bytes(made.xml)
    reading, _ = read_road(tmp_path / "road.xodr", 0.02)
    assert not reading.network.issues
    streets = [road for road in reading.network.roads.values() if not road.junction]
    assert len(streets) == 3
    assert max(road.length for road in streets) < 60.0


def area_of(surface, *lane_types):
    chosen = [p.lane_type in lane_types for p in surface.patches]
    corners = surface.vertices[surface.triangles][np.array(chosen)[surface.triangle_patch]]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum() / 2


def test_a_crossing_has_all_turns_and_is_read_without_an_issue(tmp_path):
    _, root, reading, _ = roads_of(crossing(), tmp_path)
    assert not reading.network.issues
    assert len(root.findall("junction")) == 1
    streets = [road for road in root.findall("road") if road.get("junction") == "-1"]
    assert len(streets) == 4
    ends = {road.get("id"): road.find("link/successor") for road in root.findall("road")}
    turns = {
        (c.get("incomingRoad"), ends[c.get("connectingRoad")].get("elementId"))
        for c in root.findall("junction/connection")
        if c.find("laneLink") is not None
    }
    assert len(turns) == 12
    assert root.find("header/geoReference").text.startswith("+proj=tmerc")


def test_traffic_straight_on_shares_its_road_with_the_sidewalk_beside_it(tmp_path):
    """Two roads along the same kerb would overlap; at a T there are six turns and no other road."""
    extract = Extract()
    extract.way((-100.0, 0.0), (0.0, 0.0), (100.0, 20.0), **STREET)
    extract.way((0.0, 0.0), (0.0, -100.0), **STREET)
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    turns = [road for road in root.findall("road") if road.get("junction") != "-1"]
    kinds = [sorted(lane.get("type") for lane in turn.iterfind(".//right/lane")) for turn in turns]
    assert sorted(kinds) == [["driving"]] * 3 + [["driving", "sidewalk"]] * 3
    assert max(lane_gaps(surface)) < 0.01


def test_linked_lanes_of_a_crossing_meet(tmp_path):
    extract = crossing(lanes="3", lanes__backward="1", cycleway="lane")
    extract.way((100.0, 0.0), (200.0, 0.0), **STREET, lanes="2")
    _, _, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    gaps = lane_gaps(surface)
    assert len(gaps) > 20
    assert max(gaps) < 0.01


def test_the_carriageway_lies_on_both_sides_of_the_map_s_line(tmp_path):
    extract = Extract()
    extract.way(
        (0.0, 0.0), (200.0, 0.0), highway="residential", lanes="3", width="9", sidewalk="no"
    )
    plan, _, _, surface = roads_of(extract, tmp_path)
    line = plan.streets[0].line
    assert area_of(surface, "driving", "none") == pytest.approx(
        9.0 * plan.streets[0].length, rel=1e-4
    )
    across = surface.vertices[:, 1] - np.interp(surface.vertices[:, 0], *line.T)
    assert across.max() == pytest.approx(4.5, abs=0.01)
    assert across.min() == pytest.approx(-4.5, abs=0.01)


@pytest.mark.parametrize(
    ("placement", "north"), [("right_of:1", 3.0), ("left_of:1", 0.0), ("middle_of:2", 4.75)]
)
def test_lanes_lie_beside_the_map_s_line_as_placement_says(placement, north, tmp_path):
    extract = Extract()
    extract.way(
        (0.0, 0.0), (200.0, 0.0), highway="residential", oneway="yes", lanes="3", sidewalk="no",
        width__lanes="3|3.5|4", placement=placement,
    )  # fmt: skip
    plan, _, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    across = surface.vertices[:, 1] - np.interp(surface.vertices[:, 0], *plan.streets[0].line.T)
    assert across.max() == pytest.approx(north, abs=0.01)
    assert across.min() == pytest.approx(north - 10.5, abs=0.01)


def test_through_lanes_stay_straight_where_a_turning_lane_opens_beside_the_line(tmp_path):
    """That is what mappers write ``placement`` for."""
    extract = Extract()
    tags = {"highway": "primary", "oneway": "yes", "sidewalk": "no"}
    extract.way((0.0, 0.0), (100.0, 0.0), **tags, lanes="2", placement="right_of:1")
    extract.way((100.0, 0.0), (200.0, 0.0), **tags, lanes="3", placement="right_of:2",
                turn__lanes="left|through|through")  # fmt: skip
    plan, _, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    line = plan.streets[0].line
    driving = [lane for lane in surface.lanes if lane.lane_type == "driving"]
    aside = [lane.points[:, 1] - np.interp(lane.points[:, 0], *line.T) for lane in driving]
    straight = [each for each in aside if np.ptp(each) < 0.01]
    assert len(driving) == 5
    assert sorted(round(float(each.mean()), 2) for each in straight) == [-1.75, -1.75, 1.75, 1.75]


def test_lanes_of_a_placed_way_meet_at_a_junction_with_their_arrows(tmp_path):
    extract = Extract()
    extract.way((-150.0, 0.0), (0.0, 0.0), **STREET, oneway="yes", lanes="2",
                placement="left_of:1", turn__lanes="left|through;right")  # fmt: skip
    extract.way((0.0, 0.0), (150.0, 0.0), **STREET)
    extract.way((0.0, -150.0), (0.0, 0.0), (0.0, 150.0), **STREET)
    extract.node(0.0, 0.0, highway="traffic_signals")
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    assert max(lane_gaps(surface)) < 0.01
    road = next(
        r for r in root.findall("road") if r.find("objects/object[@name='arrowLeft']") is not None
    )
    width = 2.75
    arrows = {o.get("name"): float(o.get("t")) for o in road.iterfind("objects/object")}
    assert arrows["arrowLeft"] == pytest.approx(-0.5 * width, abs=0.01)
    assert arrows["arrowStraightRight"] == pytest.approx(-1.5 * width, abs=0.01)
    assert arrows["stop line"] == pytest.approx(-width, abs=0.01)
    signal = road.find("signals/signal")
    assert float(signal.get("t")) == pytest.approx(-2.0 * width - 0.5, abs=0.01)


def test_lines_between_lanes_follow_the_changes_that_are_allowed(tmp_path):
    extract = Extract()
    extract.way((0.0, 0.0), (200.0, 0.0), highway="primary", oneway="yes", lanes="4",
                sidewalk="no", change__lanes="not_right|yes|no|not_left")  # fmt: skip
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    marks = {x.get("id"): x.find("roadMark").get("type") for x in root.iterfind(".//right/lane")}
    assert [marks[n] for n in ("-1", "-2", "-3")] == ["solid broken", "broken solid", "solid"]
    lanes = {lane.lane: lane for lane in surface.lanes}
    # Our own reader of the marks: who may change to the right.
    assert [bool(lanes[n].right) for n in (-1, -2, -3)] == [False, True, False]


def test_a_street_without_markings_has_none(tmp_path):
    extract = Extract()
    extract.way((0.0, 0.0), (200.0, 0.0), highway="primary", lanes="4", lane_markings="no")
    _, root, _, surface = roads_of(extract, tmp_path)
    assert {mark.get("type") for mark in root.iter("roadMark")} == {"none"}
    assert not any(patch.kind == "mark" for patch in surface.patches)


def test_lanes_that_begin_widen_smoothly(tmp_path):
    extract = Extract()
    extract.way((0.0, 0.0), (100.0, 0.0), **STREET, lanes="2", width="6")
    extract.way((100.0, 0.0), (200.0, 0.0), **STREET, lanes="4", width="12")
    plan, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    (road,) = root.findall("road")
    assert len(road.findall("lanes/laneSection")) == 2
    # A smooth step over 20 m covers half of its rectangle: two lanes lack 10 m each.
    assert area_of(surface, "driving") == pytest.approx(600.0 + 1200.0 - 60.0, rel=6e-3)
    assert plan.streets[0].length == pytest.approx(200.0, rel=2e-3)


def test_streets_too_near_to_one_another_share_a_junction(tmp_path):
    extract = crossing()
    extract.way((12.0, 0.0), (12.0, 80.0), **STREET)
    text = extract.text()
    extract = Extract()
    extract.way((-100.0, 0.0), (0.0, 0.0), (12.0, 0.0), (100.0, 0.0), **STREET)
    extract.way((0.0, -100.0), (0.0, 0.0), **STREET)
    extract.way((12.0, 0.0), (12.0, 80.0), **STREET)
    assert text
    _, root, reading, _ = roads_of(extract, tmp_path)
    assert not reading.network.issues
    assert len(root.findall("junction")) == 1
    assert len([r for r in root.findall("road") if r.get("junction") == "-1"]) == 4


def test_a_roundabout_leads_around_its_island(tmp_path):
    extract = Extract()
    angles = np.linspace(0.0, 2 * np.pi, 17)[:-1]
    ring = [(round(15 * np.cos(a), 3), round(15 * np.sin(a), 3)) for a in angles]
    extract.way(*ring, ring[0], highway="residential", junction="roundabout")
    for n in (0, 4, 8, 12):
        end = (ring[n][0] * 6, ring[n][1] * 6)
        extract.way(ring[n], end, **STREET)
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    assert len(root.findall("junction")) == 1
    plan = shapely.union_all(shapely.polygons(surface.vertices[surface.triangles][:, :, :2]))
    assert not plan.contains(shapely.Point(0.0, 0.0))
    holes = [shapely.Polygon(hole) for hole in plan.interiors]
    (island,) = [hole for hole in holes if hole.contains(shapely.Point(0.0, 0.0))]
    # The ring's lane of 3.5 m lies around a circle of 15 m.
    assert island.area == pytest.approx(np.pi * 13.25**2, rel=0.03)
    for lane in surface.lanes:
        if lane.junction and lane.lane_type == "driving":
            x, y = lane.points[:, :2].T
            turn = x[:-1] * np.diff(y) - y[:-1] * np.diff(x)
            near = np.hypot(x, y)[:-1] < 16.0
            assert (turn[near] > -1e-6).all()  # counter-clockwise


def test_banned_turns_have_no_connection(tmp_path):
    extract = crossing()
    members = [("way", 1000, "from"), ("node", extract.node(0.0, 0.0), "via"), ("way", 1001, "to")]
    extract.relation(members, type="restriction", restriction="no_left_turn")
    _, root, _, _ = roads_of(extract, tmp_path)
    driven = [c for c in root.findall("junction/connection") if c.find("laneLink") is not None]
    # From both halves of the first way to both halves of the second one.
    assert len(driven) == 12 - 4


def test_signals_crossings_and_arrows_stand_where_the_map_has_them(tmp_path):
    extract = Extract()
    extract.way((-150.0, 0.0), (0.0, 0.0), **STREET, oneway="yes", turn__lanes="left|through")
    extract.way((0.0, 0.0), (150.0, 0.0), **STREET)
    extract.way((0.0, 0.0), (0.0, 150.0), **STREET)
    extract.node(0.0, 0.0, highway="traffic_signals")
    extract.node(80.0, 0.0)
    extract.way((0.0, -150.0), (0.0, 0.0), **STREET)
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    assert len(root.findall(".//signal[@type='1000001']")) == 4
    arrows = [o.get("name") for o in root.iterfind(".//object") if "arrow" in o.get("name", "")]
    assert sorted(set(arrows)) == ["arrowLeft", "arrowStraight"]
    lines = [o for o in root.iterfind(".//object") if o.get("name") == "stop line"]
    assert len(lines) == 4
    assert {patch.mark_type for patch in surface.patches if patch.kind == "mark"}


def test_zebra_crossings_lie_at_their_nodes(tmp_path):
    extract = Extract()
    extract.way((0.0, 0.0), (60.0, 0.0), (150.0, 0.0), **STREET)
    extract.node(60.0, 0.0, highway="crossing", crossing="zebra")
    extract.node(110.0, 0.0)
    plan, root, _, _ = roads_of(extract, tmp_path)
    (object_,) = root.findall(".//object[@type='crosswalk']")
    assert float(object_.get("s")) == pytest.approx(60.0, rel=3e-3)
    assert plan.points[0].kind == "zebra"


def test_streets_follow_the_land_and_bridges_stand_above(tmp_path):
    extract = Extract()
    extract.way((-300.0, 0.0), (300.0, 0.0), **STREET)
    extract.way((0.0, -300.0), (0.0, -25.0), **STREET)
    extract.way((0.0, -25.0), (0.0, 25.0), **STREET, bridge="yes", layer="1")
    extract.way((0.0, 25.0), (0.0, 300.0), **STREET)
    _, root, reading, surface = roads_of(extract, tmp_path, lambda p: 100.0 + 0.02 * p[:, 0])
    assert not root.findall("junction")
    assert not reading.network.issues
    heights = {
        lane.road: lane.points[np.hypot(*lane.points[:, :2].T) < 4.0, 2].mean()
        for lane in surface.lanes
        if (np.hypot(*lane.points[:, :2].T) < 4.0).any()
    }
    low, high = sorted(heights.values())
    assert high - low == pytest.approx(CLEARANCE, abs=0.4)
    ends = [lane.points[[0, -1]] for lane in surface.lanes]
    slopes = [
        np.abs(np.diff(lane.points[:, 2])) / np.hypot(*np.diff(lane.points[:, :2], axis=0).T)
        for lane in surface.lanes
    ]
    assert max(map(np.max, slopes)) < 0.15
    far = np.concatenate(ends)
    far = far[np.abs(far[:, 0]) > 200.0]
    assert far[:, 2] == pytest.approx(100.0 + 0.02 * far[:, 0], abs=1.5)


def driven_slopes(surface, sliver):
    """Slopes of the triangles of driving lanes that are wider than slivers, metres.

    Where connecting roads part, slivers of some centimetres take up what heights differ.
    """
    driven = np.array([patch.lane_type == "driving" for patch in surface.patches])
    corners = surface.vertices[surface.triangles[driven[surface.triangle_patch]]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(1)
    wide = np.abs(normal[:, 2]) / longest > sliver
    return np.hypot(*normal[wide, :2].T) / np.abs(normal[wide, 2])


def test_no_carriageway_on_a_hillside_is_steeper_than_roads_may_be(tmp_path):
    """Land of 14 %, a crossing, two nodes that are one junction, and bends of 9 m radius."""
    extract = Extract()
    street = {**STREET, "parking:both": "no"}
    extract.way((-150.0, -60.0), (0.0, 0.0), (12.0, 3.0), (150.0, 60.0), **street)
    extract.way((0.0, -150.0), (0.0, 0.0), (0.0, 150.0), **street)
    extract.way((12.0, 3.0), (20.0, -120.0), **street)
    extract.way((150.0, 60.0), (200.0, 60.0), (210.0, 0.0), (120.0, -60.0), **street)
    _, _, _, surface = roads_of(extract, tmp_path, lambda p: 100.0 + 0.14 * p[:, 0])
    slope = driven_slopes(surface, 0.1)
    assert 0.1 < slope.max() < 0.15
    lanes = np.concatenate([lane.points for lane in surface.lanes])
    assert np.abs(lanes[:, 2] - 100.0 - 0.14 * lanes[:, 0]).max() < 5.0


def test_streets_that_fork_on_a_ridge_end_at_one_height_side_by_side(tmp_path):
    """Land falls by 20 % on both sides; at 27 degrees, ends lie 0.5 m beside each other."""
    extract = Extract()
    street = {**STREET, "parking:both": "no"}
    extract.way((-150.0, 0.0), (0.0, 0.0), (150.0, 10.0), **street)
    extract.way((0.0, 0.0), (150.0, 90.0), **street)
    _, _, _, surface = roads_of(extract, tmp_path, lambda p: 100.0 - 0.2 * np.abs(p[:, 0]))
    slope = driven_slopes(surface, 0.06)
    assert 0.1 < slope.max() < 0.15


def test_a_rounded_corner_touches_both_sides():
    line = rounded_line(np.array([[0.0, 0.0], [50.0, 0.0], [50.0, 50.0]]), 9.0, 0.4)
    assert line.length == pytest.approx(100.0 - 18.0 + 9.0 * np.pi / 2)
    points, heading = line(np.array([0.0, 41.0, line.length]))
    assert points == pytest.approx(np.array([[0.0, 0.0], [41.0, 0.0], [50.0, 50.0]]))
    assert heading == pytest.approx([0.0, 0.0, np.pi / 2])
    part = line.part(30.0, 60.0)
    at = np.linspace(0.0, 30.0, 7)
    assert part(at)[0] == pytest.approx(line(30.0 + at)[0])
