import numpy as np
import pytest

CENTRE = '<lane id="0" type="none"/>'
WIDTH = '<width sOffset="0" a="3" b="0" c="0" d="0"/>'


def lane(id_, content=WIDTH, more='type="driving"'):
    return f'<lane id="{id_}" {more}>{content}</lane>'


def section(s, left="", right="", centre=CENTRE, more=""):
    sides = f"<left>{left}</left><center>{centre}</center><right>{right}</right>"
    return f'<laneSection s="{s}" {more}>{sides}</laneSection>'


def ids(lanes):
    return [each.id for each in lanes]


def test_lanes_run_from_the_centre_outwards(network_of, road_xml, kinds):
    xml = section(0, lane(2) + lane(1), lane(-3) + lane(-1) + lane(-2))
    network = network_of(road_xml(lanes=xml))
    (found,) = network.roads["1"].sections
    assert ids(found.left) == [1, 2]
    assert ids(found.right) == [-1, -2, -3]
    assert kinds(network) == []


def test_sections_are_sorted_and_cover_the_road(network_of, road_xml, kinds):
    xml = section(60, right=lane(-1)) + section(5, right=lane(-1)) + section(20, right=lane(-1))
    network = network_of(road_xml(lanes=xml))
    found = network.roads["1"].sections
    assert [(each.s, each.end) for each in found] == [(0, 20), (20, 60), (60, 100)]
    assert kinds(network) == ["order.descending", "lane_section.start"]


def test_an_empty_section_is_left_out_and_its_links_are_joined(network_of, road_xml, kinds):
    def linked(id_, before, after):
        ends = [f'<predecessor id="{before}"/>'] if before else []
        ends += [f'<successor id="{after}"/>'] if after else []
        return lane(id_, f"<link>{''.join(ends)}</link>{WIDTH}")

    xml = (
        section(0, right=linked(-1, 0, -2))
        + section(50, right=lane(-1) + linked(-2, -1, -3))
        + section(50, right=lane(-1) + lane(-2) + linked(-3, -2, 0))
    )
    network = network_of(road_xml(lanes=xml))
    first, second = network.roads["1"].sections
    assert first.right[0].successors == (-3,)
    assert second.right[2].predecessors == (-1,)
    assert kinds(network) == ["lane_section.empty"]


def test_temporary_layers_are_kept_apart(network_of, road_xml, kinds):
    """Trap 6."""
    link = (
        '<link><successor id="-1" layer="permanent"/><successor id="-2" layer="temporary"/></link>'
    )
    permanent = section(0, right=lane(-1, link + WIDTH)) + section(50, right=lane(-1))
    temporary = section(50, right=lane(-1) + lane(-2), more='length="20"')
    xml = f'{permanent}</lanes><lanes layer="temporary">{temporary}'
    network = network_of(road_xml(lanes=xml))
    road = network.roads["1"]
    assert [ids(each.right) for each in road.sections] == [[-1], [-1]]
    assert road.sections[0].right[0].successors == (-1,)
    (layer,) = road.layers
    assert layer.name == "temporary"
    assert [(each.s, each.end, ids(each.right)) for each in layer.sections] == [(50, 70, [-1, -2])]
    assert kinds(network) == []


def test_a_one_sided_section_keeps_the_lanes_of_the_other_side(network_of, road_xml):
    taper = '<width sOffset="0" a="2" b="0.1" c="0" d="0"/>'
    xml = (
        section(0, lane(1, taper), lane(-1))
        + section(30, right=lane(-1) + lane(-2), more='singleSide="true"')
        + section(60, right=lane(-1))
    )
    first, second, third = network_of(road_xml(lanes=xml)).roads["1"].sections
    assert (ids(first.left), ids(second.left), ids(third.left)) == ([1], [1], [])
    assert first.left[0].width(np.array([20.0]))[0] == pytest.approx(4.0)
    assert second.left[0].width(np.array([5.0]))[0] == pytest.approx(2 + 0.1 * 35)
    assert (first.left[0].successors, second.left[0].predecessors) == ((1,), (1,))


def test_missing_centre_lanes_and_types_are_added(network_of, road_xml, kinds):
    xml = section(0, right=lane(-1, more=""), centre="")
    network = network_of(road_xml(lanes=xml))
    assert network.roads["1"].sections[0].centre.id == 0
    assert network.roads["1"].sections[0].right[0].type == "none"
    assert set(kinds(network)) == {"lane.no_type", "lane_section.no_centre"}


def test_lanes_without_usable_ids_are_left_out(network_of, road_xml, kinds):
    network = network_of(road_xml(lanes=section(0, right=lane(-1) + lane(-1) + lane("a"))))
    assert ids(network.roads["1"].sections[0].right) == [-1]
    assert kinds(network) == ["lane.id", "lane.id"]


def test_a_road_without_lanes_has_no_area(network_of, road_xml, kinds):
    network = network_of(road_xml(lanes=""))
    (found,) = network.roads["1"].sections
    assert (found.left, found.right, found.s, found.end) == ((), (), 0, 100)
    assert kinds(network) == ["road.no_lanes", "lane_section.no_centre"]


@pytest.mark.parametrize(("text", "level"), [("true", True), ("1", True), ("0", False)])
def test_level_is_written_in_many_ways(network_of, road_xml, text, level):
    """Trap 2: 1.1 writes 0 and 1."""
    xml = section(0, right=lane(-1, more=f'type="driving" level="{text}"'))
    assert network_of(road_xml(lanes=xml)).roads["1"].sections[0].right[0].level is level


def test_width_wins_over_border(network_of, road_xml, kinds):
    """Trap 9."""
    border = '<border sOffset="0" a="-9" b="0" c="0" d="0"/>'
    network = network_of(road_xml(lanes=section(0, right=lane(-1, border + WIDTH))))
    found = network.roads["1"].sections[0].right[0]
    assert len(found.border.start) == 0
    assert found.width(np.zeros(1))[0] == 3
    assert kinds(network) == ["lane.width_and_border"]


def test_borders_go_without_lane_offset(network_of, road_xml, kinds):
    """Trap 9."""
    border = '<border sOffset="0" a="-4" b="0" c="0" d="0"/>'
    offset = '<laneOffset s="0" a="1" b="0" c="0" d="0"/>'
    network = network_of(road_xml(lanes=offset + section(0, right=lane(-1, border))))
    road = network.roads["1"]
    assert road.lane_offset(np.array([50.0]))[0] == 0
    assert road.sections[0].right[0].border(np.zeros(1))[0] == -4
    assert kinds(network) == ["lanes.offset_and_border"]


def test_offsets_count_from_the_section_and_the_road(network_of, road_xml):
    """Trap 8."""
    step = WIDTH + '<width sOffset="10" a="5" b="0" c="0" d="0"/>'
    xml = (
        '<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="70" a="1" b="0" c="0" d="0"/>'
        + section(0, right=lane(-1))
        + section(60, right=lane(-1, step))
    )
    road = network_of(road_xml(lanes=xml)).roads["1"]
    assert road.sections[1].right[0].width(np.array([9.0, 11.0])).tolist() == [3, 5]
    assert road.lane_offset(np.array([69.0, 71.0])).tolist() == [0, 1]


def test_the_lane_offset_is_0_before_it_begins(network_of, road_xml, kinds):
    """As in ASAM's example Ex_Simple-LaneOffset, whose first offset begins 25 m along the road."""
    offset = '<laneOffset s="25" a="0" b="0" c="0.0039" d="-0.000052"/>'
    network = network_of(road_xml(lanes=offset + section(0, right=lane(-1))))
    values = network.roads["1"].lane_offset(np.array([0.0, 10.0, 25.0, 75.0]))
    assert values.tolist() == pytest.approx([0.0, 0.0, 0.0, 3.25])
    assert kinds(network) == []


def test_tiny_negative_offsets_are_clamped(network_of, road_xml, kinds):
    """Trap 8."""
    content = '<width sOffset="-1.8e-15" a="3" b="0" c="0" d="0"/>'
    content += '<roadMark sOffset="-1e-9" type="solid"/>'
    network = network_of(road_xml(lanes=section(0, right=lane(-1, content))))
    found = network.roads["1"].sections[0].right[0]
    assert found.width.start.tolist() == [0]
    assert found.marks[0].s_offset == 0
    assert kinds(network) == ["number.negative_start"] * 2


def test_a_start_below_0_moves_the_cubic(network_of, road_xml):
    content = '<width sOffset="-4" a="1" b="0.05" c="0.0025" d="0.000125"/>'
    network = network_of(road_xml(lanes=section(0, right=lane(-1, content))))
    width = network.roads["1"].sections[0].right[0].width
    ds = np.linspace(0, 100, 11)
    from_there = ds + 4
    expected = 1 + 0.05 * from_there + 0.0025 * from_there**2 + 0.000125 * from_there**3
    np.testing.assert_allclose(width(ds), expected)


@pytest.mark.parametrize(
    ("attributes", "speed"),
    [
        ('max="10"', 10),
        ('max="10" unit="m/s"', 10),
        ('max="36" unit="km/h"', 10),
        ('max="100" unit="mph"', 44.704),
        ('max="no limit"', np.inf),
        ('max="undefined"', 0),
        ('max="10" unit=""', 10),
    ],
)
def test_units_of_speed(network_of, road_xml, attributes, speed):
    """Trap 17."""
    xml = section(0, right=lane(-1, WIDTH + f'<speed sOffset="0" {attributes}/>'))
    road_type = f'<type s="0" type="town"><speed {attributes}/></type>'
    network = network_of(road_xml(lanes=xml, rest=road_type))
    assert network.roads["1"].sections[0].right[0].speed.tolist() == [[0, pytest.approx(speed)]]
    assert network.roads["1"].types[0].speed == pytest.approx(speed)
    assert network.issues == ()


def test_marks_keep_their_lines(network_of, road_xml):
    mark = """<roadMark sOffset="0" type="broken solid" weight="bold" color="yellow" width="0.2"
        laneChange="both"><sway ds="0" a="0.1" b="0" c="0" d="0"/>
      <type name="x" width="0.15"><line length="3" space="6" tOffset="0.1" sOffset="1"/></type>
      <explicit><line length="2" tOffset="0" sOffset="4" width="0.3"/></explicit></roadMark>"""
    network = network_of(road_xml(lanes=section(0, centre=lane(0, mark))))
    (found,) = network.roads["1"].sections[0].centre.marks
    assert (found.type, found.weight, found.colour, found.width) == (
        "broken solid",
        "bold",
        "yellow",
        0.2,
    )
    (line,), (explicit,) = found.lines, found.explicit
    assert (line.length, line.space, line.t_offset, line.s_offset, line.width) == (
        3,
        6,
        0.1,
        1,
        0.15,
    )
    assert (explicit.length, explicit.s_offset, explicit.width) == (2, 4, 0.3)
    assert found.sway(np.zeros(1))[0] == 0.1


def test_access_material_rule_and_user_data_are_kept(network_of, road_xml):
    more = """<material sOffset="0" surface="gravel" friction="0.7"/><access sOffset="0" rule="deny"
      restriction="bus"/><rule sOffset="0" value="x"/><userData code="a" value="b"/>"""
    extra = 'type="driving" direction="both" roadWorks="true"'
    xml = section(0, right=lane(-1, WIDTH + more, extra))
    found = network_of(road_xml(lanes=xml)).roads["1"].sections[0].right[0]
    assert (found.material, found.direction) == ("gravel", "both")
    tags = {record.tag: record.attributes for record in found.extra}
    assert tags["lane"] == {"roadWorks": "true"}
    assert tags["access"]["restriction"] == "bus"
    assert {"rule", "userData", "material"} <= set(tags)
