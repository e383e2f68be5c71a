import numpy as np
import pytest


def in_junction(road_xml, id_="9", junction="5"):
    ends = """<predecessor elementType="road" elementId="1" contactPoint="end"/>
      <successor elementType="road" elementId="2" contactPoint="start"/>"""
    plan = '<geometry s="0" x="100" y="0" hdg="0" length="20"><line/></geometry>'
    return road_xml(
        id_, length="20", attributes=f'junction="{junction}"', link=ends, plan_view=plan
    )


@pytest.fixture
def roads(road_xml):
    far = '<geometry s="0" x="120" y="0" hdg="0" length="100"><line/></geometry>'
    into = '<successor elementType="junction" elementId="5"/>'
    out = '<predecessor elementType="junction" elementId="5"/>'
    return road_xml("1", link=into) + road_xml("2", link=out, plan_view=far) + in_junction(road_xml)


def junction(content, more=""):
    return f'<junction id="5" name="" {more}>{content}</junction>'


def connection(content="", incoming="1", connecting="9", contact='contactPoint="start"'):
    return (
        f'<connection id="0" incomingRoad="{incoming}" connectingRoad="{connecting}" {contact}>'
        f"{content}</connection>"
    )


def test_connections_by_the_book(network_of, roads, kinds):
    network = network_of(roads + junction(connection('<laneLink from="-1" to="-1"/>')))
    (found,) = network.junctions["5"].connections
    assert found.lane_links == ((-1, -1),)
    assert kinds(network) == []


def test_connections_of_unknown_roads_are_left_out(network_of, roads, kinds):
    xml = junction(connection() + connection(connecting="77") + connection(incoming="77"))
    network = network_of(roads + xml)
    assert len(network.junctions["5"].connections) == 1
    assert kinds(network) == ["junction.connection"] * 2


def test_lane_links_to_lanes_that_are_not_there(network_of, roads, kinds):
    links = '<laneLink from="-1" to="-1"/><laneLink from="-8" to="-1"/><laneLink from="a" to="1"/>'
    network = network_of(roads + junction(connection(links)))
    assert network.junctions["5"].connections[0].lane_links == ((-1, -1),)
    assert kinds(network) == ["junction.lane_link"] * 2


@pytest.mark.parametrize(("contact", "there", "absent"), [("start", 1, -2), ("end", -2, 1)])
def test_lane_links_end_at_the_section_of_the_contact_point(  # noqa: PLR0917
    network_of, road_xml, kinds, contact, there, absent
):
    def section(s, *ids):
        size = '<width sOffset="0" a="3" b="0" c="0" d="0"/>'
        left, right = (
            "".join(f'<lane id="{n}" type="driving">{size}</lane>' for n in ids if sign * n > 0)
            for sign in (1, -1)
        )
        sides = f"<left>{left}</left>" if left else ""
        centre = '<center><lane id="0" type="none"/></center>'
        return f'<laneSection s="{s}">{sides}{centre}<right>{right}</right></laneSection>'

    plan = '<geometry s="0" x="100" y="0" hdg="0" length="20"><line/></geometry>'
    connecting = road_xml("9", length="20", attributes='junction="5"', plan_view=plan,
                          lanes=section(0, 1, -1) + section(10, -1, -2))  # fmt: skip
    arm = road_xml("1", link='<successor elementType="junction" elementId="5"/>')
    links = "".join(f'<laneLink from="-1" to="{to}"/>' for to in (there, absent))
    content = connection(links, contact=f'contactPoint="{contact}"')
    network = network_of(arm + connecting + junction(content))
    assert network.junctions["5"].connections[0].lane_links == ((-1, there),)
    assert kinds(network).count("junction.lane_link") == 1


def test_badly_written_ids_of_lanes_that_are_not_there(network_of, roads, kinds):
    links = '<laneLink from="-1,0" to="-1"/><laneLink from="-8,0" to="-1m"/>'
    network = network_of(roads + junction(connection(links)))
    assert network.junctions["5"].connections[0].lane_links == ((-1, -1),)
    assert kinds(network) == ["junction.lane_link"]


@pytest.mark.parametrize(("incoming", "point"), [("1", "start"), ("2", "end")])
def test_a_missing_contact_point_follows_from_the_links(network_of, roads, incoming, point):
    network = network_of(roads + junction(connection(incoming=incoming, contact="")))
    assert network.junctions["5"].connections[0].contact_point == point


def test_a_junction_that_only_its_roads_name_is_added(network_of, roads, kinds):
    network = network_of(roads)
    assert network.junctions["5"].connections == ()
    assert network.roads["1"].successor.element == "junction"
    assert kinds(network) == ["junction.missing"]


def test_direct_junctions_link_roads(network_of, roads):
    """Trap 18."""
    xml = """<connection id="0" incomingRoad="1" linkedRoad="2" contactPoint="start">
      <laneLink from="-1" to="-1" overlapZone="3"/></connection>"""
    network = network_of(roads + junction(xml, 'type="direct"'))
    (found,) = network.junctions["5"].connections
    assert (found.connecting_road, found.lane_links) == ("2", ((-1, -1),))
    assert found.extra[0].attributes["overlapZone"] == "3"


def test_virtual_junctions(network_of, roads):
    """Trap 18: main road, sStart and sEnd; connecting roads may be absent."""
    xml = """<connection id="1" type="virtual"><predecessor elementType="road" elementId="1"
      elementS="50" elementDir="+"/></connection>"""
    more = 'type="virtual" mainRoad="1" sStart="40" sEnd="60" orientation="+"'
    found = network_of(roads + junction(xml, more)).junctions["5"]
    assert (found.type, found.main_road, found.s_start, found.s_end) == ("virtual", "1", 40, 60)
    assert found.connections[0].connecting_road == ""
    assert found.connections[0].extra[0].attributes["elementS"] == "50"


def test_boundary_and_elevation_grid(network_of, roads):
    xml = """
    <planView><geometry s="0" x="100" y="-5" hdg="0" length="20"><line/></geometry></planView>
    <boundary>
      <segment type="lane" roadId="9" boundaryLane="-1" sStart="begin" sEnd="end"/>
      <segment type="joint" roadId="2" contactPoint="start" jointLaneStart="-1" jointLaneEnd="1"/>
    </boundary>
    <elevationGrid gridSpacing="10" sStart="1">
      <elevation left="1 2" center="0.5" right="3"/><elevation center="0.7"/>
    </elevationGrid>
    <crossPath id="0" crossingRoad="2" roadAtStart="1" roadAtEnd="1"/>
    <priority high="1" low="2"/>"""
    found = network_of(roads + junction(connection() + xml)).junctions["5"]
    lane, joint = found.boundary
    assert (lane.road, lane.lane, lane.s_start, lane.s_end) == ("9", -1, 0, 20)
    assert (joint.contact_point, joint.joint_lane_start, joint.joint_lane_end) == ("start", -1, 1)
    grid = found.elevation_grid
    assert (grid.spacing, grid.start, grid.centre.tolist()) == (10, 1, [0.5, 0.7])
    assert [row.tolist() for row in grid.left] == [[1, 2], []]
    assert np.isclose(found.plan_view.y, -5).all()
    assert [record.tag for record in found.extra] == ["crossPath", "priority"]
