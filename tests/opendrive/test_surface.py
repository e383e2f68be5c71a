"""The road surface as one mesh: joins, junctions, kerbs, holes, chunk borders."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

WIDTH = '<width sOffset="0" a="{}" b="0" c="0" d="0"/>'


def lane(id_, type_="driving", width=3.5, more=""):
    return f'<lane id="{id_}" type="{type_}">{WIDTH.format(width)}{more}</lane>'


def section(left="", right="", s=0, centre=""):
    sides = "".join(
        f"<{side}>{lanes}</{side}>" for side, lanes in (("left", left), ("right", right)) if lanes
    )
    middle = f'<center><lane id="0" type="none">{centre}</lane></center>'
    return f'<laneSection s="{s}">{middle}{sides}</laneSection>'


def line(x, y, heading, length):
    return f'<geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length}"><line/></geometry>'


def area_of(surface, *kinds):
    chosen = np.array([patch.kind in kinds for patch in surface.patches])[surface.triangle_patch]
    corners = surface.vertices[surface.triangles[chosen]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(normal, axis=1).sum() / 2)


def test_a_straight_road_is_a_rectangle(xodr_reader, assert_watertight):
    surface = build_surface(xodr_reader())
    assert_watertight(surface)
    assert area_of(surface, "lane") == pytest.approx(650)
    assert {patch.id for patch in surface.patches} == {"road_1_s0_lane_1", "road_1_s0_lane_-1"}
    assert len(surface.outline) == 1


def test_marks_are_cut_out_of_their_lanes(xodr_reader, assert_watertight):
    mark = '<roadMark sOffset="0" type="broken" width="0.2"/>'
    surface = build_surface(xodr_reader(lanes=section(lane(1), lane(-1), centre=mark)))
    assert_watertight(surface)
    assert area_of(surface, "mark") == pytest.approx(12 * 3 * 0.2 - 2 * 0.2, abs=0.5)
    assert area_of(surface, "mark", "lane") == pytest.approx(700)


def test_kerbs_close_the_step_to_a_raised_sidewalk(xodr_reader, assert_watertight):
    raised = '<height sOffset="0" inner="0.15" outer="0.15"/>'
    lanes = section("", lane(-1) + lane(-2, "sidewalk", 2, raised))
    surface = build_surface(xodr_reader(lanes=lanes))
    assert_watertight(surface)
    # At both ends of the road the ground rises to the sidewalk along the stones.
    ends = 2 * 0.15 * 0.15 / 2
    assert area_of(surface, "kerb") == pytest.approx(100 * 0.15 + ends)
    kerb = next(patch for patch in surface.patches if patch.kind == "kerb")
    assert kerb.lane_type == "sidewalk"


RAISED = '<height sOffset="0" inner="0.12" outer="0.12"/>'


@pytest.mark.parametrize(
    ("border", "expected"),
    [
        (lane(-2, "border", 0.3), "shoulder"),
        (lane(-2, "border", 0.3, '<height sOffset="0" inner="0" outer="0"/>'), "shoulder"),
        (lane(-2, "border", 0.3, RAISED), "curb"),
        (lane(-2, "border", 1.5), "border"),
    ],
)
def test_a_narrow_border_is_paved(network_of, road_xml, border, expected):
    """At the lane's height, as in ASAM's Ex_Crosswalk, an edge strip; wide ones are banks."""
    lanes = section(right=lane(-1) + border + lane(-3, "sidewalk", 2, RAISED))
    surface = build_surface(network_of(road_xml("1", lanes=lanes)))
    found = {patch.lane: patch.lane_type for patch in surface.patches if patch.kind == "lane"}
    assert found == {-1: "driving", -2: expected, -3: "sidewalk"}


@pytest.mark.parametrize("inner", ["sidewalk", "none"])
def test_a_narrow_border_beside_no_carriageway_is_of_kerb_stones(network_of, road_xml, inner):
    lanes = section(right=lane(-1) + lane(-2, inner, 2) + lane(-3, "border", 0.3))
    surface = build_surface(network_of(road_xml("1", lanes=lanes)))
    assert {patch.lane_type for patch in surface.patches if patch.lane == -3} == {"curb"}


def test_a_closed_carriageway_is_paved_and_a_median_is_not(network_of, road_xml):
    """In both, lanes of type none lie between shoulders; only one has traffic besides."""
    middle = lane(-2, "none") + lane(-3, "none") + lane(-4, "shoulder", 1)
    closed = section(right=lane(-1, "shoulder", 1) + middle)
    divided = section(left=lane(1), right=lane(-1, "shoulder", 1) + middle + lane(-5))
    for lanes, expected in ((closed, "restricted"), (divided, "none")):
        surface = build_surface(network_of(road_xml("1", lanes=lanes)))
        found = {patch.lane: patch.lane_type for patch in surface.patches if patch.kind == "lane"}
        assert found[-2] == found[-3] == expected
        told = any(issue.kind == "road.closed_carriageway" for issue in surface.issues)
        assert told == (expected == "restricted")


def test_a_lane_of_land_beside_the_road_is_land(network_of, road_xml):
    """By the standard an outermost lane of type none has no content; one between lanes is kept."""
    wide = lane(-1) + lane(-2, "none", 9) + lane(-3, "sidewalk", 2) + lane(-4, "none", 20)
    surface = build_surface(network_of(road_xml("1", lanes=section(lane(1, "none", 3), wide))))
    assert surface.vertices[:, 1].min() == pytest.approx(-(3.5 + 9 + 2 + 2))
    assert surface.vertices[:, 1].max() == pytest.approx(3)
    (issue,) = [issue for issue in surface.issues if issue.kind == "road.land_in_lane"]
    assert issue.where.startswith("road[id=1]")
    assert "1 outermost lanes" in issue.message
    assert "20.0 m" in issue.message


def test_kerbs_face_the_lower_side(xodr_reader):
    raised = '<height sOffset="0" inner="0.15" outer="0.15"/>'
    lanes = section("", lane(-1) + lane(-2, "sidewalk", 2, raised))
    surface = build_surface(xodr_reader(lanes=lanes))
    kerb = np.array([patch.kind == "kerb" for patch in surface.patches])[surface.triangle_patch]
    corners = surface.vertices[surface.triangles[kerb]]
    along = np.abs(np.ptp(corners[..., 0], axis=1)) > 1.0
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[along]
    assert (normal[:, 1] > 0).all()
    assert (np.abs(normal[:, 2]) < 1e-12).all()


def test_sections_share_their_border(xodr_reader, assert_watertight):
    lanes = section(lane(1), lane(-1)) + section(lane(1, width=2), lane(-1) + lane(-2), s=40)
    surface = build_surface(xodr_reader(lanes=lanes))
    assert_watertight(surface)
    assert area_of(surface, "lane", "transition") == pytest.approx(40 * 7 + 60 * 9, rel=0.02)


def two_roads(road_xml, gap):
    to_second = '<successor elementType="road" elementId="2" contactPoint="start"/>'
    to_first = '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
    first = lane(-1, more="").replace("<width", '<link><successor id="-1"/></link><width')
    second = lane(-1).replace("<width", '<link><predecessor id="-1"/></link><width')
    return road_xml("1", link=to_second, lanes=section("", first)) + road_xml(
        "2", link=to_first, lanes=section("", second), plan_view=line(100 + gap, 0, 0, 100)
    )


@pytest.mark.parametrize("gap", [0.0, 0.0004, 0.004, 0.3, 2.0])
def test_gaps_between_linked_roads_are_closed(network_of, road_xml, assert_watertight, gap):
    surface = build_surface(network_of(two_roads(road_xml, gap)))
    assert_watertight(surface)
    assert len(surface.outline) == 1
    assert area_of(surface, "lane", "transition") == pytest.approx((200 + gap) * 3.5, abs=0.02)
    gaps = [issue for issue in surface.issues if issue.kind == "lane.gap"]
    assert len(gaps) == (gap > 0.01)


def test_a_narrower_lane_gets_a_taper(network_of, road_xml, assert_watertight):
    roads = two_roads(road_xml, 0.0)
    before, after = roads.split('<road id="2"')
    surface = build_surface(network_of(before + '<road id="2"' + after.replace('a="3.5"', 'a="3"')))
    assert_watertight(surface)
    assert area_of(surface, "transition") == pytest.approx(0.5 * 5 / 2, rel=0.01)
    assert [issue.kind for issue in surface.issues] == ["lane.gap"]


@pytest.mark.parametrize("turn", [1, -1])
def test_a_taper_follows_its_bend(network_of, road_xml, assert_watertight, turn):
    """A wedge of 0.5 m by 5 m of s beside a lane of 3 m, on a circle of 20 m."""
    roads = two_roads(road_xml, 0.0)
    before, after = roads.split('<road id="2"')
    after = after.replace('a="3.5"', 'a="3"').replace("<line/>", f'<arc curvature="{turn / 20}"/>')
    surface = build_surface(network_of(before + '<road id="2"' + after))
    assert_watertight(surface)
    # The length at t is that of s times 1 - t / R; the wedge's middle lies 3 m + 0.5 / 3 m aside.
    expected = 0.5 * 5 / 2 * (1 + turn * (3 + 0.5 / 3) / 20)
    assert area_of(surface, "transition") == pytest.approx(expected, rel=0.02)


def test_crossing_roads_do_not_overlap(network_of, road_xml, assert_watertight):
    crossing = road_xml("2", plan_view=line(50, -50, np.pi / 2, 100))
    surface = build_surface(network_of(road_xml("1") + crossing))
    assert_watertight(surface)
    assert area_of(surface, "lane") == pytest.approx(2 * 650 - 6.5**2, rel=1e-6)


def junction_of(road_xml, lanes):
    """Two connecting roads that cross, and the junction that holds them."""
    roads = road_xml("1", attributes='junction="9"', lanes=lanes) + road_xml(
        "2", attributes='junction="9"', lanes=lanes, plan_view=line(50, -50, np.pi / 2, 100)
    )
    return roads + '<junction id="9" name=""/>'


def test_a_junction_is_covered_once(network_of, road_xml, assert_watertight):
    surface = build_surface(network_of(junction_of(road_xml, section(lane(1), lane(-1)))))
    assert_watertight(surface)
    assert area_of(surface, "lane", "junction") == pytest.approx(2 * 700 - 49, rel=1e-6)
    assert area_of(surface, "junction") == pytest.approx(49, rel=1e-6)
    (middle,) = [patch for patch in surface.patches if patch.kind == "junction"]
    assert (middle.junction, middle.lane_type) == ("9", "driving")


def test_driving_lanes_win_over_sidewalks_that_cross_them(network_of, road_xml, assert_watertight):
    raised = '<height sOffset="0" inner="0.15" outer="0.15"/>'
    lanes = section(lane(1), lane(-1) + lane(-2, "sidewalk", 2, raised))
    surface = build_surface(network_of(junction_of(road_xml, lanes)))
    assert_watertight(surface)
    middle = np.array([50.0, 0.0])
    corners = surface.vertices[surface.triangles]
    near = (np.abs(corners[..., :2].mean(axis=1) - middle) < 3.5).all(axis=1)
    types = {surface.patches[k].lane_type for k in surface.triangle_patch[near]}
    assert types == {"driving"}


def test_gaps_within_a_junction_are_filled_and_islands_stay(
    network_of, road_xml, assert_watertight
):
    def ring(size):
        places = [(0, 0, 0), (size, 0, 90), (size, size, 180), (0, size, 270)]
        lanes = section(lane(1, width=1), lane(-1, width=1))
        return (
            "".join(
                road_xml(
                    str(k),
                    length=str(size),
                    attributes='junction="9"',
                    lanes=lanes,
                    plan_view=line(x, y, np.radians(turn), size),
                )
                for k, (x, y, turn) in enumerate(places)
            )
            + '<junction id="9" name=""/>'
        )

    small = build_surface(network_of(ring(6)))
    assert_watertight(small)
    assert len(small.outline) == 1
    assert area_of(small, "filler") == pytest.approx(16, rel=1e-3)
    large = build_surface(network_of(ring(30)))
    assert_watertight(large)
    assert len(large.outline) == 2
    assert area_of(large, "filler") == 0


def test_roads_of_different_height_meet_without_a_step(network_of, road_xml, assert_watertight):
    hill = '<elevation s="0" a="0.3" b="0" c="0" d="0"/>'
    roads = road_xml("1", attributes='junction="9"') + road_xml(
        "2",
        attributes='junction="9"',
        plan_view=line(50, -50, np.pi / 2, 100),
        elevation=hill,
    )
    surface = build_surface(network_of(roads + '<junction id="9" name=""/>'))
    assert_watertight(surface)
    assert area_of(surface, "kerb") == 0
    assert 0 <= surface.vertices[:, 2].min() < surface.vertices[:, 2].max() <= 0.3


def test_the_outline_has_vertices_where_chunks_meet(xodr_reader):
    surface = build_surface(xodr_reader(plan_view=line(150, 190, 0.3, 100)))
    for ring in surface.outline_loops():
        following = np.roll(ring, -1, axis=0)
        for axis in (0, 1):
            low = np.minimum(ring[:, axis], following[:, axis])
            high = np.maximum(ring[:, axis], following[:, axis])
            assert not ((low < 200) & (high > 200)).any()


def test_no_triangle_reaches_over_a_chunk_border(xodr_reader):
    surface = build_surface(xodr_reader(plan_view=line(150, 190, 0.3, 100)))
    corners = surface.vertices[surface.triangles][..., :2]
    assert not ((corners.min(axis=1) < 200) & (corners.max(axis=1) > 200)).any()


curves = st.tuples(
    st.floats(-0.2, 0.2),
    st.floats(-0.2, 0.2),
    st.floats(0, 6.28),
    st.floats(-1000, 1000),
    st.floats(-0.1, 0.1),
)


@settings(max_examples=25)
@given(curves)
def test_any_curve_is_watertight(xodr_reader, assert_watertight, curve):
    start, end, heading, x, roll = curve
    plan_view = (
        f'<geometry s="0" x="{x}" y="0" hdg="{heading}" length="60">'
        f'<spiral curvStart="{start}" curvEnd="{end}"/></geometry>'
    )
    mark = '<roadMark sOffset="0" type="broken broken" width="0.15"/>'
    raised = '<height sOffset="0" inner="0.15" outer="0.15"/>'
    surface = build_surface(
        xodr_reader(
            length="60",
            plan_view=plan_view,
            lateral=f'<superelevation s="0" a="{roll}" b="0" c="0" d="0"/>',
            lanes=section(lane(1) + lane(2, "sidewalk", 2, raised), lane(-1), centre=mark),
        )
    )
    assert_watertight(surface)


def test_a_network_without_area_is_refused(xodr_reader):
    with pytest.raises(EnvgenError, match="no road has a lane with a width"):
        build_surface(xodr_reader(lanes=section("", lane(-1, width=0))))


@pytest.mark.parametrize(
    "name",
    [
        "esmini/fabriksgatan",
        "esmini/e6mini",
        "carla_test/Town01",
        "malidrive/TShapeRoad",
        "asam_ex16/UC_2Lane-RoundAbout-3Arms",
        "malidrive/SmallTownRoads",
        "scenic/Town04_0910",
    ],
)
def test_real_files_are_watertight(corpus, assert_watertight, name):
    assert_watertight(build_surface(read_network(corpus / f"{name}.xodr")))


def test_an_issue_of_the_file_is_counted_once(network_of, road_xml):
    """The network tells of the file and the surface of the geometry; commands print both."""
    network = network_of(road_xml(length="90"))
    assert [issue.kind for issue in network.issues] == ["road.length"]
    assert build_surface(network).issues == ()


def shortest_edges(surface):
    """Length of each triangle's shortest edge, metres."""
    corners = surface.vertices[surface.triangles]
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).min(axis=1)


@pytest.mark.parametrize("aside", [0.001, 0.003, 0.02])
@pytest.mark.parametrize("turn", [0.0, 1e-4, 2e-3])
def test_roads_that_nearly_coincide_leave_no_slivers(
    network_of, road_xml, assert_watertight, aside, turn
):
    surface = build_surface(
        network_of(
            road_xml("1", plan_view=line(0, 0, 0, 100))
            + road_xml("2", plan_view=line(3, aside, turn, 90))
        )
    )
    assert_watertight(surface)
    assert shortest_edges(surface).min() > 4e-3


@pytest.mark.parametrize("name", ["carla_test/Town01", "crdesigner/four_way_crossing"])
def test_real_surfaces_have_hardly_an_edge_of_a_millimetre(corpus, name):
    shortest = shortest_edges(build_surface(read_network(corpus / f"{name}.xodr")))
    assert (shortest < 1.5e-3).mean() < 1e-3
