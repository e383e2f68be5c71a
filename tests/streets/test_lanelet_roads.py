"""Lanelets as OpenDRIVE, read back and held against the linestrings of the map."""

import numpy as np
import pytest
import shapely
from lxml import etree
from tests.places.lanelet_files import LaneletWriter, bend, crossing, roundabout, two_lanes
from tests.streets.lane_gaps import lane_gaps

from envgen_usd.models.road_feature import SignalFeature
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.geometry.lane_borders import lane_borders
from envgen_usd.places.lanelets.lanelet_reading import read_lanelet_map
from envgen_usd.recipe.map_land import read_road
from envgen_usd.streets.lanelets.lanelet_roads import lanelet_roads


def roads_of(file, tmp_path):
    """The file as XML, its reading, its surface and the result."""
    made = lanelet_roads(read_lanelet_map(file.write(tmp_path / "map.osm")), "map")
    path = tmp_path / "road.xodr"
    path.write_bytes(made.xml)
    reading, surface = read_road(path, 0.02)
    return etree.fromstring(made.xml), reading, surface, made


def lane_lines(network):
    """Borders of all lanes in plan, as our reader of OpenDRIVE evaluates them."""
    lines = []
    for road in network.roads.values():
        for section in road.sections:
            s = np.linspace(section.s, section.end, max(int(4 * (section.end - section.s)), 2))
            x, y, heading = evaluate(road.plan_view, s)
            for t in lane_borders(road, section, s).t.T:
                places = np.column_stack([x - t * np.sin(heading), y + t * np.cos(heading)])
                lines.append(shapely.LineString(places))
    return lines


def farthest(file, network):
    """Largest distance of points of the lanelets' bounds from the borders of lanes, metres."""
    tree = shapely.STRtree(lane_lines(network))
    bounds = [p for p in file.bounds.values() if len(p) > 2]
    points = [shapely.segmentize(shapely.LineString(p[:, :2]), 0.5) for p in bounds]
    places = shapely.points(shapely.get_coordinates(points))
    return tree.query_nearest(places, return_distance=True, all_matches=False)[1].max()


def test_lanelets_side_by_side_are_one_road_with_marks_kerb_and_limit(tmp_path):
    root, reading, _, _ = roads_of(two_lanes(), tmp_path)
    assert not reading.network.issues
    (road,) = root.findall("road")
    lanes = {lane.get("id"): lane for lane in road.iter("lane")}
    kinds = {number: lane.get("type") for number, lane in lanes.items()}
    assert kinds == {"1": "driving", "0": "none", "-1": "driving", "-2": "sidewalk"}
    marks = {number: lane.find("roadMark").get("type") for number, lane in lanes.items()}
    assert marks == {"1": "none", "0": "broken", "-1": "curb", "-2": "none"}
    assert float(lanes["-2"].find("height").get("inner")) == pytest.approx(0.12)
    assert lanes["-1"].find("speed").get("max") == "30"
    assert lanes["1"].find("speed") is None
    assert float(road.get("length")) == pytest.approx(60.0)


def test_a_bend_of_growing_width_and_height_keeps_its_bounds(tmp_path):
    file = bend(climb=4.0)
    root, reading, surface, _ = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert farthest(file, reading.network) < 0.05
    corners = np.concatenate(list(file.bounds.values()))
    near = np.argmin(np.hypot(*(surface.vertices[:, None, :2] - corners[:, :2]).T), axis=1)
    # Marks of 0.25 m are cut beside the borders, so the nearest vertex is up to 0.15 m away.
    assert np.abs(surface.vertices[near, 2] - corners[:, 2]).max() < 0.05
    assert {lane.get("id") for lane in root.iter("lane")} == {"0", "-1", "-2"}
    weights = [lane.find("roadMark").get("weight") for lane in root.iter("lane")]
    assert weights == ["bold", "standard", "bold"]


@pytest.mark.parametrize(("skew", "largest"), [(0.0, 0.05), (2.0, 0.15)])
def test_a_crossing_has_all_ways_without_gaps(skew, largest, tmp_path):
    file = crossing(skew)
    root, reading, surface, made = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert made.counts["roads"] == 4
    assert made.counts["junctions"] == 1
    assert len(root.findall(".//connection/laneLink")) == 8
    ways = [lane for lane in surface.lanes if len(lane.successors) == 2]
    assert len(ways) == 4
    assert max(lane_gaps(surface)) < 0.002
    assert "lane.gap" not in {issue.kind for issue in surface.issues}
    lights = [p for p in file.bounds.values() if len(p) == 2]
    assert lights
    assert farthest(file, reading.network) < largest


@pytest.mark.parametrize("radius", [5.0, 8.0, 12.0])
def test_ways_through_a_ring_keep_their_bounds(radius, tmp_path):
    file = roundabout(radius)
    root, reading, surface, _ = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert farthest(file, reading.network) < 0.05
    assert max(lane_gaps(surface)) < 0.002
    inside = [road for road in root.findall("road") if road.get("junction") != "-1"]
    # No way ends within the ring.
    assert all(len(road.find("link")) == 2 for road in inside)


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("inner_left", [True, False])
@pytest.mark.parametrize("turned", [True, False])
def test_lanes_that_come_back_to_their_begin_are_linked_to_it(parts, inner_left, turned, tmp_path):
    file = LaneletWriter()
    for k in range(parts):
        angle = 2 * np.pi / parts * (k + np.linspace(0.0, 1.0, 49))
        inner, outer = (
            np.column_stack([r * np.cos(angle), r * np.sin(angle)]).round(3) for r in (20.0, 24.0)
        )
        sides = [file.way(inner[:: -1 if turned else 1]), file.way(outer)]
        file.lanelet(*(sides if inner_left else sides[::-1]))
    root, reading, surface, _ = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert farthest(file, reading.network) < 0.05
    assert len(lane_gaps(surface)) == parts
    assert max(lane_gaps(surface)) < 0.002
    lengths = [float(road.get("length")) for road in root.findall("road")]
    assert sum(lengths) == pytest.approx(2 * np.pi * (20.0 if inner_left else 24.0), rel=0.01)


def test_roads_meet_without_a_step_of_slope(tmp_path):
    """The frame of a road leans with its slope, so lanes of two slopes would part at a seam."""
    file = LaneletWriter()
    x = np.linspace(0.0, 40.0, 9)
    rows = {}
    for part, rise in ((0, 0.02), (1, -0.08)):
        for y in (4.0, 0.0):
            z = 0.05 * y + rise * x + 0.8 * part
            rows[part, y] = file.way(np.column_stack([x + 40.0 * part, np.full(9, y), z]))
        file.lanelet(rows[part, 4.0], rows[part, 0.0])
    root, _, surface, _ = roads_of(file, tmp_path)
    slopes = []
    for road in root.findall("road"):
        length = float(road.get("length"))
        rows = [{k: float(v) for k, v in e.items()} for e in road.iter("elevation")]
        d = length - rows[-1]["s"]
        slopes += [rows[0]["b"], rows[-1]["b"] + 2 * d * rows[-1]["c"] + 3 * d**2 * rows[-1]["d"]]
    assert slopes[1] == pytest.approx(slopes[2], abs=1e-6)
    assert -0.08 < slopes[1] < 0.02
    assert max(lane_gaps(surface)) < 0.002


def test_lights_and_stop_lines_stand_where_the_map_has_them(tmp_path):
    root, _, surface, _ = roads_of(crossing(), tmp_path)
    signals = root.findall(".//signal")
    assert [signal.get("type") for signal in signals] == ["1000001"] * 4
    assert {signal.get("zOffset") for signal in signals} == {"3.5"}
    # A light faces who enters the crossing: against the arm, which leads away from it.
    for signal in signals:
        road = signal.getparent().getparent()
        inwards = road.find("link/successor[@elementType='junction']") is not None
        assert signal.get("orientation") == ("+" if inwards else "-")
    places = np.array(
        [f.pose.position[:2] for f in surface.features if isinstance(f, SignalFeature)]
    )
    assert sorted(np.abs(places).ravel().round(2)) == pytest.approx([4.5] * 4 + [11.0] * 4)
    assert len(root.findall(".//object[@name='stop line']")) == 4


def test_a_crosswalk_and_a_sign_are_on_their_road(tmp_path):
    file = two_lanes()
    left = file.way([[28.0, -6.0], [28.0, 4.0]], "zebra_marking", "")
    right = file.way([[32.0, -6.0], [32.0, 4.0]], "zebra_marking", "")
    file.lanelet(left, right, subtype="crosswalk")
    file.way([[20.0, -4.0, 2.0], [20.0, -4.4, 2.0]], "traffic_sign", "de274-30")
    file.way([[25.0, -4.0, 2.0], [25.0, -4.4, 2.0]], "traffic_sign", "stop here")
    file.way([[50.0, -3.0], [50.0, 0.0]], "stop_line", "")
    file.way([[50.0, -3000.0], [50.0, 0.0]], "stop_line", "")
    root, reading, surface, made = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert made.counts["crosswalks"] == 1
    stripes = [p.kind == "crosswalk" for p in surface.patches]
    corners = surface.vertices[surface.triangles][np.array(stripes)[surface.triangle_patch]]
    assert corners[..., 0].min() == pytest.approx(28.0, abs=0.06)
    assert corners[..., 0].max() == pytest.approx(32.0, abs=0.06)
    (signal,) = root.findall(".//signal")
    assert (signal.get("type"), signal.get("subtype"), signal.get("country")) == ("274", "30", "DE")
    assert float(signal.get("s")) == pytest.approx(20.0, abs=1e-6)
    assert float(signal.get("t")) == pytest.approx(-4.2, abs=1e-6)
    assert signal.get("orientation") == "+"
    assert made.counts["stop lines"] == 1
    unused = [issue.message for issue in made.issues if issue.kind == "lanelet.unused"]
    assert any("stop here" in text for text in unused)
    assert any("stop lines beyond" in text for text in unused)


def row(file, x, ys, kinds=()):
    """Ways along x at each y, from left to right."""
    kinds = kinds or [("line_thin", "solid")] * len(ys)
    return [
        file.way([[at, y] for at in np.linspace(*x, 5)], *kind)
        for y, kind in zip(ys, kinds, strict=True)
    ]


def test_roads_that_follow_each_other_are_linked_lane_by_lane(tmp_path):
    file = LaneletWriter()
    a, b = row(file, (0.0, 30.0), (3.0, 0.0, -3.0)), row(file, (30.0, 60.0), (3.0, 0.0, -3.0, -6.0))
    for left, right in ((a[0], a[1]), (a[1], a[2]), (b[0], b[1]), (b[1], b[2]), (b[2], b[3])):
        file.lanelet(left, right)
    root, reading, surface, made = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert made.counts["junctions"] == 0
    first, second = root.findall("road")
    assert first.find("link/successor").attrib == {
        "elementType": "road", "elementId": "2", "contactPoint": "start",
    }  # fmt: skip
    assert second.find("link/predecessor").get("elementId") == "1"
    follows = {
        lane.get("id"): lane.find("link/predecessor").get("id")
        for lane in second.iter("lane")
        if lane.find("link/predecessor") is not None
    }
    assert follows == {"-1": "-1", "-2": "-2"}
    assert max(lane_gaps(surface)) < 1e-3


def test_lanes_that_part_without_overlap_meet_in_a_direct_junction(tmp_path):
    file = LaneletWriter()
    a = row(file, (0.0, 30.0), (3.0, 0.0, -3.0))
    file.lanelet(a[0], a[1])
    file.lanelet(a[1], a[2])
    for y, away in ((3.0, 4.0), (0.0, -4.0)):
        ways = [
            file.way([[30.0, y - k], [45.0, y - k + away / 4], [60.0, y - k + away]])
            for k in (0.0, 3.0)
        ]
        file.lanelet(*ways)
    root, reading, surface, _ = roads_of(file, tmp_path)
    assert not reading.network.issues
    (junction,) = root.findall("junction")
    assert junction.get("type") == "direct"
    links = {link.get("from") for link in junction.iter("laneLink")}
    assert links == {"-1", "-2"}
    assert sum(len(lane.successors) for lane in surface.lanes) == 2


def test_traffic_on_the_left_is_recognised(tmp_path):
    file = LaneletWriter()
    ways = row(file, (0.0, 40.0), (3.5, 0.0, -3.5))
    file.lanelet(ways[0], ways[1])
    file.lanelet(ways[2], ways[1])
    root, reading, surface, _ = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert root.find("road").get("rule") == "LHT"
    assert root.find(".//lane[@direction]") is None
    for lane in surface.lanes:
        ahead = lane.points[-1, 0] > lane.points[0, 0]
        assert ahead == (lane.points[0, 1] > 0.0)


def test_double_lines_keep_their_sides(tmp_path):
    file = LaneletWriter()
    kinds = [("line_thin", "solid"), ("line_thin", "solid_dashed"), ("line_thin", "dashed_solid")]
    ways = row(file, (0.0, 40.0), (3.5, 0.0, -3.5), kinds)
    file.lanelet(ways[0], ways[1])
    file.lanelet(ways[1], ways[2])
    backwards = file.way([[40.0, -7.0], [0.0, -7.0]], "line_thin", "solid_dashed", color="yellow")
    file.lanelet(ways[2], backwards)
    root, _, _, _ = roads_of(file, tmp_path)
    marks = {lane.get("id"): lane.find("roadMark") for lane in root.iter("lane")}
    # Seen along the road, the last line is broken on its left.
    kinds = {number: mark.get("type") for number, mark in marks.items()}
    assert kinds == {"0": "solid", "-1": "solid broken", "-2": "broken solid", "-3": "broken solid"}
    assert marks["-3"].get("color") == "yellow"


def test_a_bridge_over_a_road_makes_no_junction(tmp_path):
    file = LaneletWriter()
    low = [[[x, y, 0.0] for x in np.linspace(-40.0, 40.0, 9)] for y in (2.0, -2.0)]
    high = [[[x, y, 6.0] for y in np.linspace(-40.0, 40.0, 9)] for x in (-2.0, 2.0)]
    file.lanelet(*(file.way(points) for points in low))
    file.lanelet(*(file.way(points) for points in high))
    _, reading, _, made = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert (made.counts["roads"], made.counts["junctions"]) == (2, 0)
    heights = sorted(road.elevation(np.array([40.0]))[0] for road in reading.network.roads.values())
    assert heights == pytest.approx([0.0, 6.0], abs=1e-6)


def test_walls_fences_and_guard_rails_stand_on_their_bounds(tmp_path):
    file = LaneletWriter()
    x = np.linspace(0.0, 60.0, 31)
    wave = 0.5 * np.sin(x / 10.0)
    lines = {
        kind: file.way(np.column_stack([x, y + wave]), kind, "", **tags)
        for kind, y, tags in (
            ("wall", 4.0, {"height": "2.5 m"}),
            ("guard_rail", 0.0, {}),
            ("fence", -4.0, {"height": "1e9"}),
        )
    }
    file.lanelet(lines["guard_rail"], lines["wall"])
    file.lanelet(lines["guard_rail"], lines["fence"])
    root, reading, surface, made = roads_of(file, tmp_path)
    assert not reading.network.issues
    assert "linestrings of type wall" not in str(made.issues)
    assert {made.counts[k] for k in ("walls", "guard rails", "fences")} == {1}
    heights = {o.get("name"): float(o.get("height")) for o in root.iter("object")}
    assert heights == {"wall": 2.5, "guardRail": 0.75, "fence": 1.2}
    assert sorted({feature.kind for feature in surface.features}) == [
        "fence",
        "guard_rail",
        "wall",
    ]
    middle = {"wall": 4.12, "guard_rail": 0.0, "fence": -4.025}
    for feature in surface.features:
        corners = np.concatenate([part.points for part in feature.parts.values()])
        away = corners[:, 1] - np.interp(corners[:, 0], x, wave) - middle[feature.kind]
        assert np.abs(away).max() < 0.3
        assert corners[:, 2].max() == pytest.approx(heights[feature.source.name], abs=0.02)


def test_right_of_way_becomes_priorities_of_connecting_roads(tmp_path):
    file = crossing()
    text = file.write(tmp_path / "first.osm").read_text()
    relations = etree.fromstring(text.encode()).findall("relation")
    lanelets = [r.get("id") for r in relations if r.find("tag[@v='lanelet']") is not None]
    # Arms come first, two lanes each; the second one enters the crossing. Straight ways and turns
    # go on from them; opposite straight ways share a bound and a road.
    arms, ways = lanelets[:8], lanelets[8:]
    first, second = arms[1], ways[5]
    file.raw(
        '<relation id="9001">'
        f'<member type="relation" ref="{first}" role="right_of_way"/>'
        f'<member type="relation" ref="{second}" role="yield"/>'
        '<tag k="type" v="regulatory_element"/><tag k="subtype" v="right_of_way"/></relation>'
    )
    root, _, _, made = roads_of(file, tmp_path)
    names = {r.get("name").removeprefix("lanelet "): r.get("id") for r in root.findall("road")}
    pairs = {(p.get("high"), p.get("low")) for p in root.iter("priority")}
    straight = names[(names.keys() & {ways[0], ways[4]}).pop()]
    assert pairs == {(straight, names[second]), (names[ways[1]], names[second])}
    assert "right_of_way" not in str(made.issues)


def test_kerbs_without_a_sidewalk_and_areas_are_counted(tmp_path):
    file = two_lanes()
    x = [[0.0, 40.0], [60.0, 40.0]]
    kerb, other = file.way(x, "curbstone", "high"), file.way([[p, q + 4] for p, q in x])
    file.lanelet(other, kerb)
    for kind in ("parking", "parking", "vegetation"):
        number = file._id()
        file.raw(
            f'<relation id="{number}"><tag k="type" v="multipolygon"/>'
            f'<tag k="subtype" v="{kind}"/></relation>'
        )
    _, _, _, made = roads_of(file, tmp_path)
    messages = [issue.message for issue in made.issues]
    assert "1 curbstones with no lanelet for pedestrians behind them" in messages
    assert "3 areas (multipolygons) are no part of a road: 2 parking, 1 vegetation" in messages
