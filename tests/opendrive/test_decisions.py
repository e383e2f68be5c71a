"""What the program decides beyond the file is an issue, with its amount."""

import re

import numpy as np
import pytest

from envgen_usd.opendrive.surface import build_surface

WIDTH = '<width sOffset="0" a="{}" b="0" c="0" d="0"/>'


def lane(id_, kind="driving", width=3.5, rest=""):
    return f'<lane id="{id_}" type="{kind}">{WIDTH.format(width)}{rest}</lane>'


def section(*right, centre=""):
    return (
        f'<laneSection s="0"><center><lane id="0" type="none">{centre}</lane></center>'
        f"<right>{''.join(right)}</right></laneSection>"
    )


def line(x, y, length):
    return f'<geometry s="0" x="{x}" y="{y}" hdg="0" length="{length}"><line/></geometry>'


def area_of(surface, *kinds):
    corners = surface.vertices[surface.triangles][..., :2]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    size = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    chosen = np.array([patch.kind in kinds for patch in surface.patches])
    return float(size[chosen[surface.triangle_patch]].sum())


def only(issues, kind):
    (issue,) = [each for each in issues if each.kind == kind]
    return issue


@pytest.mark.parametrize("width", ["2", "1.01", "0.02"])
def test_a_mark_of_an_absurd_width_is_sized_by_the_environment(network_of, road_xml, width):
    mark = f'<roadMark sOffset="0" type="solid" width="{width}"/>'
    network = network_of(road_xml(lanes=section(lane(-1), centre=mark)))
    issue = only(network.issues, "road_mark.width")
    assert f"width={width}" in issue.message
    surface = build_surface(network)
    # Half of the mark is off the road.
    assert area_of(surface, "mark") == pytest.approx(100 * 0.12 / 2, rel=1e-2)
    assert "1 have no width" in only(surface.issues, "road_mark.size").message


@pytest.mark.parametrize("width", ["1", "0.03"])
def test_a_wide_or_narrow_mark_keeps_the_width_of_the_file(network_of, road_xml, width):
    mark = f'<roadMark sOffset="0" type="solid" width="{width}"/>'
    network = network_of(road_xml(lanes=section(lane(-1), centre=mark)))
    surface = build_surface(network)
    assert area_of(surface, "mark") == pytest.approx(100 * float(width) / 2, rel=0.05)
    assert not [i for i in (*network.issues, *surface.issues) if i.kind.startswith("road_mark.")]


def test_a_curve_tighter_than_any_road_does_not_fan_its_lanes_out(network_of, road_xml):
    """The curvature turns the road by 2.5 rad and back again within 0.1 m."""
    plan = (
        '<geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry>'
        '<geometry s="10" x="10" y="0" hdg="0" length="0.1">'
        '<spiral curvStart="-100" curvEnd="100"/></geometry>'
        '<geometry s="10.1" x="10.1" y="0" hdg="0" length="9.9"><line/></geometry>'
    )
    network = network_of(road_xml(length="20", plan_view=plan, lanes=section(lane(-1))))
    assert "100 1/m" in only(network.issues, "plan_view.tight").message
    assert area_of(build_surface(network), "lane") == pytest.approx(20 * 3.5, rel=1e-3)


def test_a_turn_as_tight_as_a_wheel_is_no_issue(network_of, road_xml):
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="0.336"><arc curvature="6.661"/></geometry>'
    network = network_of(road_xml(length="0.336", plan_view=plan, lanes=section(lane(-1))))
    assert not [issue for issue in network.issues if issue.kind == "plan_view.tight"]


@pytest.mark.parametrize(("width", "kind"), [(0.5, {"shoulder"}), (0.8, {"border"})])
def test_narrow_borders_are_edge_strips(network_of, road_xml, width, kind):
    network = network_of(road_xml(lanes=section(lane(-1), lane(-2, "border", width))))
    surface = build_surface(network)
    assert {patch.lane_type for patch in surface.patches} == {"driving"} | kind
    told = [issue.message for issue in surface.issues if issue.kind == "road.paved_border"]
    assert len(told) == (width < 0.6)


def in_junction(road_xml, *paths):
    """A road of 7 m before and after a junction, and paths through it: (y, lanes)."""
    arm = '<{} elementType="junction" elementId="9"/>'
    both = section(lane(-1), lane(-2))
    roads = road_xml("1", length="50", plan_view=line(0, 0, 50), lanes=both,
                     link=arm.format("successor"))  # fmt: skip
    roads += road_xml("3", length="50", plan_view=line(90, 0, 50), lanes=both,
                      link=arm.format("predecessor"))  # fmt: skip
    connections = ""
    for number, (y, lanes, rest) in enumerate(paths):
        id_ = str(10 + number)
        link = (
            '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
            '<successor elementType="road" elementId="3" contactPoint="start"/>'
        )
        roads += road_xml(id_, length="40", attributes='junction="9"', lanes=lanes, link=link,
                          plan_view=line(50, y, 40), **rest)  # fmt: skip
        connections += (
            f'<connection id="{number}" incomingRoad="1" connectingRoad="{id_}"'
            ' contactPoint="start"/>'
        )
    return f'{roads}<junction id="9" name="">{connections}</junction>'


def test_area_between_connecting_roads_is_told_in_square_metres(network_of, road_xml):
    """Two paths leave a gap of 1 m, which roads close at both ends."""
    paths = [(0, section(lane(-1, width=3)), {}), (-4, section(lane(-1, width=3)), {})]
    surface = build_surface(network_of(in_junction(road_xml, *paths)))
    issue = only(surface.issues, "junction.filled")
    (told,) = re.findall(r"([\d.]+) m²", issue.message)
    assert float(told) == pytest.approx(40, abs=0.2)
    assert area_of(surface, "filler") == pytest.approx(40, abs=0.2)
    assert issue.where == "junction[id=9]"


def test_a_slit_between_roads_is_told_in_square_metres(network_of, road_xml):
    """Two strips of 2 m, 0.3 m apart, joined by roads across their ends."""
    plans = [line(0, 0, 60), line(0, -2.3, 60)]
    across = '<geometry s="0" x="{}" y="-4.3" hdg="1.5707963267949" length="4.3"><line/></geometry>'
    lanes = section(lane(-1, width=2))
    roads = "".join(road_xml(str(k), length="60", plan_view=plan, lanes=lanes)
                    for k, plan in enumerate(plans))  # fmt: skip
    ends = "".join(road_xml(str(7 + k), length="4.3", plan_view=across.format(x), lanes=lanes)
                   for k, x in enumerate((0, 58)))  # fmt: skip
    surface = build_surface(network_of(roads + ends))
    (told,) = re.findall(r"([\d.]+) m²", only(surface.issues, "road.filled").message)
    assert float(told) == pytest.approx((58 - 2) * 0.3, abs=0.1)


def test_connecting_roads_that_disagree_in_height_are_told(network_of, road_xml):
    up = {"elevation": '<elevation s="0" a="0.1" b="0" c="0" d="0"/>'}
    wide = section(lane(-1, width=5))
    paths = [(0, wide, {}), (-2, wide, up)]
    surface = build_surface(network_of(in_junction(road_xml, *paths)))
    assert "0.100 m" in only(surface.issues, "junction.heights").message


def test_marks_across_other_roads_are_told(network_of, road_xml):
    mark = '<roadMark sOffset="0" type="solid" width="0.12"/>'
    paths = [(0, section(lane(-1, width=4, rest=mark)), {}), (-2, section(lane(-1, width=5)), {})]
    surface = build_surface(network_of(in_junction(road_xml, *paths)))
    assert not area_of(surface, "mark")
    assert only(surface.issues, "junction.hidden_mark").message.startswith("1 lines")


def test_roads_without_anything_open_have_no_issue(network_of, road_xml):
    assert build_surface(network_of(road_xml())).issues == ()


ACROSS = '<geometry s="0" x="50" y="-50" hdg="1.5707963267949" length="100"><line/></geometry>'


@pytest.mark.parametrize("is_named", [True, False])
def test_a_bridge_that_the_file_does_not_name_is_told(network_of, road_xml, is_named):
    high = '<elevation s="0" a="6" b="0" c="0" d="0"/>'
    bridge = '<objects><bridge id="1" s="30" length="40" name="" type="concrete"/></objects>'
    upper = road_xml("2", plan_view=ACROSS, elevation=high, rest=bridge if is_named else "")
    surface = build_surface(network_of(road_xml() + upper))
    told = [issue.where for issue in surface.issues if issue.kind == "road.unnamed_bridge"]
    assert told == ([] if is_named else ["road[id=2]"])


def test_painted_cross_paths_and_continued_corners_are_told(network_of, road_xml):
    walk = section(lane(-1, "walking", 3))
    across = '<geometry s="0" x="50" y="-6" hdg="1.57079632679" length="12"><line/></geometry>'
    crossing = road_xml("2", length="12", lanes=walk, plan_view=across)
    junction = (
        '<junction id="9" name="" type="virtual" mainRoad="1" sStart="48" sEnd="54">'
        '<crossPath id="0" crossingRoad="2" roadAtStart="1" roadAtEnd="1"/></junction>'
    )
    surface = build_surface(network_of(road_xml() + crossing + junction))
    assert only(surface.issues, "road.cross_path").where == "road[id=2]"
    beside = section(lane(-1), lane(-2, "sidewalk", 2))
    roads = in_junction(road_xml, (0, section(lane(-1)), {})).replace(
        section(lane(-1), lane(-2)), beside
    )
    surface = build_surface(network_of(roads))
    assert "1 gaps" in only(surface.issues, "junction.corner").message
    assert area_of(surface, "junction") == pytest.approx(40 * 2, rel=0.02)


@pytest.mark.parametrize("x", [-200, 0, 200])
@pytest.mark.parametrize("y", [-200, 0, 200])
def test_continued_corners_meet_their_arms_wherever_the_junction_lies(
    network_of, road_xml, assert_watertight, x, y
):
    beside = section(lane(-1), lane(-2, "sidewalk", 2))
    roads = in_junction(road_xml, (0, section(lane(-1)), {})).replace(
        section(lane(-1), lane(-2)), beside
    )
    for start, length in ((0, 50), (50, 40), (90, 50)):
        roads = roads.replace(line(start, 0, length), line(start + x, y, length))
    surface = build_surface(network_of(roads))
    assert_watertight(surface)
    assert only(surface.issues, "junction.corner")
    assert area_of(surface, "lane", "junction", "kerb") == pytest.approx(140 * 5.5, abs=1e-3)
    plan = surface.vertices[:, :2] - (x, y)
    corner = np.array([patch.kind == "junction" for patch in surface.patches])
    used = plan[np.unique(surface.triangles[corner[surface.triangle_patch]])]
    np.testing.assert_allclose([used.min(axis=0), used.max(axis=0)], [[50, -5.5], [90, -3.5]])
    assert area_of(surface, "junction") == pytest.approx(40 * 2)


def test_a_junction_goes_on_from_its_arms_without_a_step(network_of, road_xml, assert_watertight):
    """Connecting roads disagree by 1 m; within 0.5 m of an arm, at most 1.5 cm of it show."""
    lanes = section(lane(-1))
    width = re.search("<width[^>]*>", lanes)[0]
    # A border that bends has vertices there.
    bent = (("0", "3.4", "0.4"), ("0.4", "3.56", "-0.2"), ("0.9", "3.46", "0"))
    widths = "".join(f'<width sOffset="{s}" a="{a}" b="{b}" c="0" d="0"/>' for s, a, b in bent)
    lanes = lanes.replace(width, widths)
    high = {"elevation": '<elevation s="0" a="1" b="0" c="0" d="0"/>'}
    surface = build_surface(network_of(in_junction(road_xml, (0, lanes, {}), (-2, lanes, high))))
    assert_watertight(surface)
    x, _, z = surface.vertices.T
    assert z[(x < 50) | (x > 90)] == pytest.approx(0, abs=1e-9)
    beside = ((x > 50) & (x < 50.5)) | ((x > 89.5) & (x < 90))
    assert np.abs(z[beside]).max() < 0.015


@pytest.mark.parametrize("rise", [1.0, -0.5])
def test_a_corner_cuts_no_steep_triangles_from_a_lane_over_a_hump(
    network_of, road_xml, assert_watertight, rise
):
    """A connecting road of 40 m goes up and down by two cubics, each 1.5 times its mean slope."""
    beside = section(lane(-1), lane(-2, "sidewalk", 2))
    square, cube = 3 * rise / 20**2, 2 * rise / 20**3
    up = f'<elevation s="0" a="0" b="0" c="{square}" d="{-cube}"/>'
    down = f'<elevation s="20" a="{rise}" b="0" c="{-square}" d="{cube}"/>'
    roads = in_junction(road_xml, (0, section(lane(-1)), {"elevation": up + down})).replace(
        section(lane(-1), lane(-2)), beside
    )
    surface = build_surface(network_of(roads))
    assert_watertight(surface)
    assert only(surface.issues, "junction.corner")
    corners = surface.vertices[surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    kerb = np.array([patch.kind == "kerb" for patch in surface.patches])[surface.triangle_patch]
    slope = np.hypot(*normal[~kerb, :2].T) / normal[~kerb, 2]
    assert 0.9 < slope.max() / (1.5 * abs(rise) / 20) < 1.05


@pytest.mark.parametrize("turn", [1, -1])
def test_a_corner_around_a_bend_is_a_part_of_a_ring(network_of, road_xml, assert_watertight, turn):
    """A lane of 3.5 m turns by 90 degrees with a radius of 20 m; its sidewalk of 2 m goes on."""
    beside = section(lane(-1), lane(-2, "sidewalk", 2))
    arm = '<{} elementType="junction" elementId="9"/>'
    link = (
        '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
        '<successor elementType="road" elementId="3" contactPoint="start"/>'
    )
    length = 10 * np.pi
    bend = (
        f'<geometry s="0" x="50" y="0" hdg="0" length="{length}">'
        f'<arc curvature="{turn / 20}"/></geometry>'
    )
    away = (
        f'<geometry s="0" x="70" y="{turn * 20}" hdg="{turn * np.pi / 2}" length="50"><line/>'
        "</geometry>"
    )
    roads = (
        road_xml("1", length="50", plan_view=line(0, 0, 50), lanes=beside,
                 link=arm.format("successor"))
        + road_xml("3", length="50", plan_view=away, lanes=beside, link=arm.format("predecessor"))
        + road_xml("10", length=f"{length}", attributes='junction="9"', plan_view=bend, link=link,
                   lanes=section(lane(-1)))
    )  # fmt: skip
    connection = '<connection id="0" incomingRoad="1" connectingRoad="10" contactPoint="start"/>'
    surface = build_surface(network_of(f'{roads}<junction id="9" name="">{connection}</junction>'))
    assert_watertight(surface)
    inner = 20 + turn * 3.5
    ring = np.pi / 4 * abs((inner + turn * 2) ** 2 - inner**2)
    assert area_of(surface, "junction") == pytest.approx(ring, rel=0.02)
    chosen = np.array([patch.kind == "junction" for patch in surface.patches])
    used = surface.vertices[np.unique(surface.triangles[chosen[surface.triangle_patch]]), :2]
    radius = np.hypot(*(used - (50, turn * 20)).T)
    assert sorted((inner, inner + turn * 2)) == pytest.approx(
        [radius.min(), radius.max()], abs=0.06
    )
