"""Traps of the format that need a whole surface to be seen; each file is made by the test."""

import numpy as np
import pytest

from envgen_usd.opendrive.geometry.road_frame import road_points
from envgen_usd.opendrive.surface import build_surface

RAISED = '<height sOffset="0" inner="0.15" outer="0.15"/>'


def lane(id_, type_="driving", width=3.5, more=""):
    size = f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
    return f'<lane id="{id_}" type="{type_}">{size}{more}</lane>'


def section(left="", right="", s=0, centre=""):
    sides = "".join(
        f"<{side}>{lanes}</{side}>" for side, lanes in (("left", left), ("right", right)) if lanes
    )
    middle = f'<center><lane id="0" type="none">{centre}</lane></center>'
    return f'<laneSection s="{s}">{middle}{sides}</laneSection>'


def line(x, length, y=0):
    return f'<geometry s="0" x="{x}" y="{y}" hdg="0" length="{length}"><line/></geometry>'


def area_of(surface, *kinds):
    chosen = np.array([patch.kind in kinds for patch in surface.patches])[surface.triangle_patch]
    corners = surface.vertices[surface.triangles[chosen]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(normal, axis=1).sum() / 2)


def test_a_curve_is_not_followed_beyond_its_end(network_of, road_xml):
    """Trap 5: the declared length is not the curve's."""
    curve = (
        '<geometry s="0" x="0" y="0" hdg="0" length="100"><paramPoly3 pRange="normalized"'
        ' aU="0" bU="90" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0"/></geometry>'
    )
    network = network_of(road_xml(plan_view=curve))
    assert "plan_view.arc_length" in {issue.kind for issue in network.issues}
    points = road_points(network.roads["1"], np.array([0.0, 50.0, 100.0, 130.0]))
    assert points[:, 0].max() <= 90.001
    assert build_surface(network).vertices[:, 0].max() == pytest.approx(90, abs=0.01)


def test_layers_are_not_summed(network_of, road_xml, assert_watertight):
    """Trap 6: the road is as large as its permanent lanes, and has the marks of all layers."""
    yellow = '<roadMark sOffset="0" type="solid" width="0.2" color="yellow"/>'
    white = yellow.replace("yellow", "white")
    permanent = section("", lane(-1, more=white) + lane(-2))
    temporary = section("", lane(-1, width=3, more=yellow) + lane(-2, width=3))
    surface = build_surface(
        network_of(road_xml(lanes=f'{permanent}</lanes><lanes layer="temporary">{temporary}'))
    )
    assert_watertight(surface)
    assert area_of(surface, "lane", "mark") == pytest.approx(700)
    painted = {patch.colour: patch for patch in surface.patches if patch.kind == "mark"}
    assert set(painted) == {"white", "yellow"}
    yellow_area = {k for k, patch in enumerate(surface.patches) if patch.id == painted["yellow"].id}
    chosen = np.isin(surface.triangle_patch, list(yellow_area))
    y = surface.vertices[surface.triangles[chosen]][..., 1]
    assert (y.min(), y.max()) == pytest.approx((-3.1, -2.9))


def test_a_cross_section_surface_replaces_superelevation_and_shape(xodr_reader):
    """Trap 10."""
    lateral = """<superelevation s="0" a="0.2" b="0" c="0" d="0"/>
      <shape s="0" t="0" a="1" b="0" c="0" d="0"/>
      <crossSectionSurface><surfaceStrips>
        <strip id="1"><constant><coefficients s="0" a="0.25"/></constant></strip>
        <strip id="-1"><linear><coefficients s="0" a="-0.1"/></linear></strip>
      </surfaceStrips></crossSectionSurface>"""
    road = next(iter(xodr_reader(lateral=lateral).roads.values()))
    points = road_points(road, np.full(2, 50.0), np.array([2.0, -2.0]))
    np.testing.assert_allclose(points[:, 1], [2.0, -2.0], atol=1e-12)
    np.testing.assert_allclose(points[:, 2], [0.25, -0.2], atol=1e-12)


def test_lane_height_is_a_step_and_never_lifts_the_centre(xodr_reader, assert_watertight):
    """Trap 12."""
    centre = RAISED + '<roadMark sOffset="0" type="solid" width="0.2"/>'
    surface = build_surface(
        xodr_reader(lanes=section(lane(1), lane(-1, "sidewalk", 2, RAISED), centre=centre))
    )
    assert_watertight(surface)
    flat = np.array([patch.kind != "kerb" for patch in surface.patches])[surface.triangle_patch]
    corners = surface.vertices[surface.triangles[flat]]
    middle = corners.mean(axis=1)
    left, right = middle[:, 1] > 0, middle[:, 1] < 0
    assert np.ptp(corners[left][..., 2]) == np.ptp(corners[right][..., 2]) == 0
    assert corners[left][0, 0, 2] == 0
    assert corners[right][0, 0, 2] == pytest.approx(0.15)


def test_far_from_the_origin_nothing_moves(xodr_reader, assert_watertight):
    """Trap 19: a file in the coordinates of its projection."""
    near = build_surface(xodr_reader(plan_view=line(150, 100, y=40)))
    far = build_surface(xodr_reader(plan_view=line(451_200 + 150, 100, y=5_296_800 + 40)))
    assert_watertight(far)
    shift = np.array([451_200, 5_296_800, 0])
    there = np.unique(np.round((far.vertices - shift) * 1000).astype(int), axis=0)
    np.testing.assert_array_equal(there, np.unique(np.round(near.vertices * 1000), axis=0))


def through(road_xml, inner, outer, heights=("", "", ""), beyond=None):
    """A road, its path through a junction, and the road beyond it, 50 m each along +x."""
    start, end = ('elementType="junction" elementId="9"',) * 2
    before = road_xml(
        "1",
        length="50",
        plan_view=line(0, 50),
        lanes=outer,
        link=f"<successor {start}/>",
        elevation=heights[0],
    )
    inside = road_xml(
        "2",
        length="50",
        attributes='junction="9"',
        plan_view=line(50, 50),
        lanes=inner,
        link='<predecessor elementType="road" elementId="1" contactPoint="end"/>'
        '<successor elementType="road" elementId="3" contactPoint="start"/>',
        elevation=heights[1],
    )
    after = road_xml(
        "3",
        length="50",
        plan_view=line(100, 50),
        lanes=beyond or outer,
        link=f"<predecessor {end}/>",
        elevation=heights[2],
    )
    junction = (
        '<junction id="9" name=""><connection id="0" incomingRoad="1" connectingRoad="2"'
        ' contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>'
    )
    return before + inside + after + junction


def test_shoulders_go_on_beside_a_junction(network_of, road_xml, assert_watertight):
    inner = section(lane(1), lane(-1))
    outer = section(lane(1) + lane(2, "shoulder", 2), lane(-1) + lane(-2, "shoulder", 2))
    surface = build_surface(network_of(through(road_xml, inner, outer)))
    assert_watertight(surface)
    assert surface.vertices[:, 1].max() == pytest.approx(5.5)
    assert area_of(surface, "lane", "junction") == pytest.approx(150 * 11, rel=1e-3)


def test_unpaved_lanes_between_paved_ones_are_paved(network_of, road_xml, assert_watertight):
    outer = section(lane(1), lane(-1, "driving", 3) + lane(-2))
    inner = section(lane(1), lane(-1, "none", 3) + lane(-2))
    surface = build_surface(network_of(through(road_xml, inner, outer)))
    assert_watertight(surface)
    assert {patch.lane_type for patch in surface.patches} == {"driving", "shoulder"}
    assert [i.kind for i in surface.issues if i.kind.startswith("junction.unp")] == [
        "junction.unpaved_lane"
    ]


@pytest.mark.parametrize(("beyond", "expected"), [("driving", "shoulder"), ("none", "none")])
def test_an_unpaved_lane_is_judged_from_end_to_end(network_of, road_xml, beyond, expected):
    """Neither does its middle section touch a road outside, nor does a lane end in grass."""
    outer = [section(lane(1), lane(-1, kind, 3) + lane(-2)) for kind in ("driving", beyond)]
    part = section(lane(1), lane(-1, "none", 3) + lane(-2))
    inner = "".join(part.replace('s="0"', f's="{s}"', 1) for s in (0, 20, 35))
    roads = through(road_xml, inner, outer[0], beyond=outer[1])
    surface = build_surface(network_of(roads))
    lanes = [p for p in surface.patches if (p.road, p.lane, p.kind) == ("2", -1, "lane")]
    assert {p.section: p.lane_type for p in lanes} == dict.fromkeys(range(3), expected)


def test_a_median_goes_on_through_a_junction(network_of, road_xml):
    lanes = section(lane(1), lane(-1, "none", 3) + lane(-2))
    surface = build_surface(network_of(through(road_xml, lanes, lanes)))
    assert {patch.lane_type for patch in surface.patches} == {"driving", "none"}


def test_connecting_roads_that_disagree_become_one_smooth_surface(
    network_of, road_xml, assert_watertight
):
    """Two roads cross 0.4 m apart; between them no slope is steeper than a ramp."""
    hill = '<elevation s="0" a="0.4" b="0" c="0" d="0"/>'
    lanes = section(lane(1), lane(-1))
    across = '<geometry s="0" x="75" y="-25" hdg="1.5707963" length="50"><line/></geometry>'
    other = road_xml(
        "4",
        length="50",
        attributes='junction="9"',
        plan_view=across,
        lanes=lanes,
        elevation=hill,
    )
    surface = build_surface(network_of(through(road_xml, lanes, lanes) + other))
    assert_watertight(surface)
    corners = surface.vertices[surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.hypot(*normal[:, :2].T).max() > 0
    slope = np.hypot(*normal[:, :2].T) / normal[:, 2]
    assert slope[normal[:, 2] > 0.02].max() < 0.12
    arms = (corners[..., 0] <= 50.0005).all(axis=1) | (corners[..., 0] >= 99.9995).all(axis=1)
    assert np.abs(corners[arms][..., 2]).max() == 0
    middle = np.hypot(*(corners[..., :2].mean(axis=1) - (75, 0)).T) < 3
    assert corners[middle][..., 2].min() > 0.1
    assert corners[middle][..., 2].max() < 0.3


def turning(road_xml, id_, turn):
    """A narrow path around the middle of a crossing, on one of its four sides."""
    x, y = 8 * np.cos(turn), 8 * np.sin(turn)
    path = (
        f'<geometry s="0" x="{x + 10 * np.sin(turn)}" y="{y - 10 * np.cos(turn)}"'
        f' hdg="{turn + np.pi / 2}" length="20"><line/></geometry>'
    )
    lanes = section(lane(1, width=1), lane(-1, width=1))
    return road_xml(id_, length="20", attributes='junction="9"', plan_view=path, lanes=lanes)


def test_the_middle_of_a_crossing_is_paved(network_of, road_xml, assert_watertight):
    """Paths of those who turn leave the middle free; it is no island."""
    roads = "".join(turning(road_xml, str(k), k * np.pi / 2) for k in range(4))
    surface = build_surface(network_of(roads + '<junction id="9" name=""/>'))
    assert_watertight(surface)
    assert len(surface.outline) == 1
    assert area_of(surface, "filler") == pytest.approx(14**2, rel=1e-6)


def test_the_island_of_a_roundabout_stays(network_of, road_xml, assert_watertight):
    ring = (
        '<geometry s="0" x="8" y="0" hdg="1.57079632679" length="50.2654824574">'
        '<arc curvature="0.125"/></geometry>'
    )
    lanes = section(lane(1, width=1), lane(-1, width=1))
    road = road_xml(
        "1", length="50.2654824574", attributes='junction="9"', plan_view=ring, lanes=lanes
    )
    surface = build_surface(network_of(road + '<junction id="9" name=""/>'))
    assert_watertight(surface)
    assert len(surface.outline) == 2
