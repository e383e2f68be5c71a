"""Centre lines of lanes and how traffic passes from one to the next."""

import numpy as np
import pytest

from envgen_usd.opendrive.geometry.section_grids import section_grids
from envgen_usd.opendrive.lanes.lane_lines import lane_lines
from envgen_usd.opendrive.reader import read_network

LANE = (
    '<lane id="{id}" type="driving"><link>{link}</link>'
    '<width sOffset="0" a="3" b="0" c="0" d="0"/></lane>'
)


def lines_of(network):
    grids = section_grids(network.roads.values(), 0.02)
    return {line.id: line for line in lane_lines(network, grids)}


def both_ways(link_left="", link_right=""):
    return f"""<laneSection s="0"><left>{LANE.format(id=1, link=link_left)}</left>
    <center><lane id="0" type="none"/></center>
    <right>{LANE.format(id=-1, link=link_right)}</right></laneSection>"""


def test_traffic_on_the_right_drives_along_s(xodr_reader):
    lines = lines_of(xodr_reader())
    right, left = lines["road_1_s0_lane_-1"], lines["road_1_s0_lane_1"]
    np.testing.assert_allclose(right.points[[0, -1]], [[0, -1.5, 0], [100, -1.5, 0]], atol=1e-6)
    np.testing.assert_allclose(left.points[[0, -1]], [[100, 1.75, 0], [0, 1.75, 0]], atol=1e-6)


def test_traffic_on_the_left_drives_the_other_way(xodr_reader):
    lines = lines_of(xodr_reader(attributes='junction="-1" rule="LHT"'))
    assert lines["road_1_s0_lane_-1"].points[0, 0] == pytest.approx(100)
    assert lines["road_1_s0_lane_1"].points[0, 0] == pytest.approx(0)


def test_neighbours_are_those_of_the_same_direction(xodr_reader):
    lanes = f"""<laneSection s="0"><left>{LANE.format(id=1, link="")}</left>
    <center><lane id="0" type="none"/></center>
    <right>{LANE.format(id=-1, link="")}{LANE.format(id=-2, link="")}</right></laneSection>"""
    lines = lines_of(xodr_reader(lanes=lanes))
    inner, outer = lines["road_1_s0_lane_-1"], lines["road_1_s0_lane_-2"]
    assert (inner.left, inner.right) == ("", outer.id)
    assert (outer.left, outer.right) == (inner.id, "")


@pytest.mark.parametrize("contact", ["start", "end"])
def test_linked_roads_follow_the_direction_of_travel(network_of, road_xml, contact):
    sign = 1 if contact == "start" else -1
    ahead = '<successor id="{}"/>'
    back = '<predecessor id="{}"/>' if contact == "start" else ahead
    place = 'x="100" y="0" hdg="0"' if sign > 0 else f'x="200" y="0" hdg="{np.pi}"'
    link = "successor" if contact == "end" else "predecessor"
    network = network_of(
        road_xml(
            "1",
            link=f'<successor elementType="road" elementId="2" contactPoint="{contact}"/>',
            lanes=both_ways(ahead.format(sign), ahead.format(-sign)),
        )
        + road_xml(
            "2",
            link=f'<{link} elementType="road" elementId="1" contactPoint="end"/>',
            lanes=both_ways(back.format(sign), back.format(-sign)),
            plan_view=f'<geometry s="0" {place} length="100"><line/></geometry>',
        )
    )
    lines = lines_of(network)
    onward = f"road_2_s0_lane_{-sign}"
    assert lines["road_1_s0_lane_-1"].successors == (onward,)
    assert lines[onward].predecessors == ("road_1_s0_lane_-1",)
    assert lines["road_1_s0_lane_1"].successors == ()
    assert lines["road_1_s0_lane_1"].predecessors == (f"road_2_s0_lane_{sign}",)


def test_connections_lead_into_the_junction(network_of, road_xml):
    network = network_of(
        road_xml("1", link='<successor elementType="junction" elementId="9"/>', lanes=both_ways())
        + road_xml("2", attributes='junction="9"', lanes=both_ways())
        + """<junction id="9" name=""><connection id="0" incomingRoad="1" connectingRoad="2"
        contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>"""
    )
    assert lines_of(network)["road_1_s0_lane_-1"].successors == ("road_2_s0_lane_-1",)


def test_lines_of_a_real_town_join_end_to_start(corpus):
    lines = lines_of(read_network(corpus / "carla_test/Town01.xodr"))
    driving = [line for line in lines.values() if line.lane_type == "driving"]
    linked = [line for line in driving if line.successors]
    assert len(linked) > 0.9 * len(driving)
    for line in linked:
        for name in line.successors:
            onward = lines[name]
            assert line.id in onward.predecessors
            assert np.linalg.norm(line.points[-1] - onward.points[0]) < 0.6, (line.id, name)


TYPES = """<type s="0" type="town"><speed max="50" unit="km/h"/></type>
<type s="40" type="rural"><speed max="100" unit="km/h"/></type>
<type s="70" type="motorway"><speed max="no limit"/></type>"""


@pytest.mark.parametrize(
    ("s", "of_lane", "speed"),
    [
        (0, "", 50 / 3.6),
        (39, "", 50 / 3.6),
        (40, "", 100 / 3.6),
        (60, "", 100 / 3.6),
        (80, "", 0.0),
        (0, '<speed sOffset="0" max="30" unit="km/h"/>', 30 / 3.6),
        (60, '<speed sOffset="0" max="20" unit="mph"/>', 20 * 1609.344 / 3600),
        (0, '<speed sOffset="0" max="no limit"/>', 0.0),
    ],
)
def test_the_limit_is_that_of_the_lane_or_of_the_type_that_has_begun(
    network_of, road_xml, s, of_lane, speed
):
    """OpenDRIVE 8.3 and 11.8.2: a type holds from its s to the next; a lane's limit is stronger."""
    width = '<width sOffset="0" a="3" b="0" c="0" d="0"/>'
    section = (
        '<laneSection s="{}"><center><lane id="0"/></center><right>'
        f'<lane id="-1" type="driving">{width}{of_lane}</lane></right></laneSection>'
    )
    starts = dict.fromkeys((0, s))
    lanes = "".join(section.format(start) for start in starts)
    road = road_xml(lanes=lanes).replace("<planView>", f"{TYPES}<planView>")
    lines = lines_of(network_of(road))
    assert lines[f"road_1_s{len(starts) - 1}_lane_-1"].speed == pytest.approx(speed)
