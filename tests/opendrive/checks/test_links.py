import pytest

STRAIGHT = '<geometry s="0" x="{x}" y="0" hdg="0" length="100"><line/></geometry>'


def link(side, id_, contact="", element="road"):
    point = f'contactPoint="{contact}"' if contact else ""
    return f'<{side} elementType="{element}" elementId="{id_}" {point}/>'


def two(road_xml, first, second, **more):
    return road_xml("1", link=first, **more) + road_xml(
        "2", link=second, plan_view=STRAIGHT.format(x=100)
    )


def test_links_by_the_book(network_of, road_xml, kinds):
    xml = two(road_xml, link("successor", "2", "start"), link("predecessor", "1", "end"))
    network = network_of(xml)
    assert network.roads["1"].successor.id == "2"
    assert kinds(network) == []


@pytest.mark.parametrize("element", ["road", "junction"])
def test_links_to_nothing_are_left_out(network_of, road_xml, kinds, element):
    network = network_of(road_xml(link=link("successor", "99", "start", element)))
    assert network.roads["1"].successor is None
    assert kinds(network) == ["link.unknown"]


def test_a_wrong_kind_of_element_is_repaired(network_of, road_xml, kinds):
    xml = two(
        road_xml, link("successor", "2", "start", "junction"), link("predecessor", "1", "end")
    )
    network = network_of(xml)
    assert network.roads["1"].successor.element == "road"
    assert kinds(network) == ["link.element_type"]


@pytest.mark.parametrize("contact", ["", "end"])
def test_the_contact_point_is_the_end_that_is_near(network_of, road_xml, kinds, contact):
    xml = two(road_xml, link("successor", "2", contact), link("predecessor", "1", "end"))
    network = network_of(xml)
    assert network.roads["1"].successor.contact_point == "start"
    assert kinds(network) == ["link.contact_point"]


def test_a_link_that_is_not_answered_is_reported(network_of, road_xml, kinds):
    network = network_of(two(road_xml, link("successor", "2", "start"), ""))
    assert kinds(network) == ["link.one_sided"]


def test_a_link_into_the_middle_of_a_road(network_of, road_xml, kinds):
    """Trap 18: virtual junctions link to a place along the main road."""
    end = '<predecessor elementType="road" elementId="1" elementS="40" elementDir="-"/>'
    network = network_of(two(road_xml, "", end))
    found = network.roads["2"].predecessor
    assert (found.s, found.direction, found.contact_point) == (40, "-", "")
    assert kinds(network) == []


def test_lane_links_to_lanes_that_are_not_there_are_left_out(network_of, road_xml, kinds):
    lanes = """<laneSection s="0"><center><lane id="0"/></center><right>
      <lane id="-1" type="driving"><link><successor id="-1"/><successor id="-7"/></link>
      <width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right></laneSection>"""
    xml = two(
        road_xml,
        link("successor", "2", "start"),
        link("predecessor", "1", "end"),
        lanes=lanes,
    )
    network = network_of(xml)
    assert network.roads["1"].sections[0].right[0].successors == (-1,)
    assert kinds(network) == ["lane.link_unknown"]


@pytest.mark.parametrize("spelling", ["-1.0", "-1,0", "-1m"])
def test_lanes_with_badly_written_ids_lose_their_bad_links_too(
    network_of, road_xml, kinds, spelling
):
    lanes = f"""<laneSection s="0"><center><lane id="0"/></center><right>
      <lane id="{spelling}" type="driving"><link><successor id="-7,0"/></link>
      <width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right></laneSection>"""
    ends = link("successor", "2", "start"), link("predecessor", "1", "end")
    network = network_of(two(road_xml, *ends, lanes=lanes))
    (lane,) = network.roads["1"].sections[0].right
    assert (lane.id, lane.successors) == (-1, ())
    assert "lane.link_unknown" in kinds(network)
