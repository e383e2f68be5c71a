"""Crosswalks, stop lines, arrows, bays and lines of objects on the surface."""

import re

import numpy as np
import pytest
import shapely

from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.opendrive.strips.paint_shapes import arrow
from envgen_usd.opendrive.surface import build_surface


@pytest.fixture
def surface_with(xodr_reader):
    def make(rest):
        return build_surface(xodr_reader(rest=rest))

    return make


def objects(type_, more="/>", *, name="", t=0, hdg=0):
    place = f'id="7" s="50" t="{t}" zOffset="0" hdg="{hdg}"'
    return f'<objects><object type="{type_}" name="{name}" {place} {more}</object></objects>'


def painted(surface, *kinds):
    """Area and bounds in plan of the patches of some kinds."""
    chosen = np.array([patch.kind in kinds for patch in surface.patches])[surface.triangle_patch]
    corners = surface.vertices[surface.triangles[chosen]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    plan = corners[..., :2].reshape(-1, 2)
    return normal[:, 2].sum() / 2, (*plan.min(axis=0), *plan.max(axis=0))


def test_a_crosswalk_has_stripes_along_the_road(surface_with, assert_watertight):
    corners = "".join(
        f'<cornerRoad s="{s}" t="{t}" dz="0" height="0" id="{k}"/>'
        for k, (s, t) in enumerate([(48, -3), (52, -3), (52, 3), (48, 3)])
    )
    outlines = f'><outlines><outline id="0">{corners}</outline></outlines>'
    surface = surface_with(objects("crosswalk", outlines))
    assert_watertight(surface)
    area, bounds = painted(surface, "crosswalk")
    assert area == pytest.approx(12, rel=1e-3)
    assert (bounds[0], bounds[2]) == pytest.approx((48, 52))
    assert -3 <= bounds[1] < bounds[3] <= 3


def test_markings_of_a_crosswalk_replace_the_stripes(surface_with, assert_watertight):
    corners = "".join(
        f'<cornerRoad s="{s}" t="{t}" dz="0" height="0" id="{k}"/>'
        for k, (s, t) in enumerate([(48, -3), (52, -3), (52, 3), (48, 3)])
    )
    marking = (
        '<marking width="0.2" color="yellow" lineLength="0.5" spaceLength="0.5" startOffset="0" '
        'stopOffset="1"><cornerReference id="1"/><cornerReference id="2"/></marking>'
    )
    more = (
        f'><outlines><outline id="0">{corners}</outline></outlines><markings>{marking}</markings>'
    )
    surface = surface_with(objects("crosswalk", more))
    assert_watertight(surface)
    area, bounds = painted(surface, "mark")
    assert area == pytest.approx(5 * 0.5 * 0.2, rel=1e-3)
    assert bounds == pytest.approx((51.9, -3, 52.1, 1.5))
    assert {patch.colour for patch in surface.patches if patch.kind == "mark"} == {"yellow"}
    # What is not painted is the crosswalk itself: 4 m by 6 m without the line's inner half.
    area, bounds = painted(surface, "crosswalk")
    assert area == pytest.approx(24 - 5 * 0.5 * 0.1, rel=1e-3)
    assert bounds == pytest.approx((48, -3, 52, 3))
    assert {patch.colour for patch in surface.patches if patch.kind == "crosswalk"} == {""}


@pytest.mark.parametrize(
    ("given", "rules", "width"),
    [
        ("", RMS_MARKS, 0.12),
        ("", MarkRules(width=0.2), 0.2),
        ('weight="bold"', MarkRules(width=0.2), 0.4),
        ('weight="bold" width="0.3"', MarkRules(width=0.2), 0.3),
    ],
)
def test_lines_of_an_object_are_as_wide_as_the_file_or_the_environment_says(
    xodr_reader, given, rules, width
):
    marking = f'<marking side="front" color="white" lineLength="1" spaceLength="0" {given}/>'
    more = f'length="4" width="2"><markings>{marking}</markings>'
    area, _ = painted(
        build_surface(xodr_reader(rest=objects("crosswalk", more)), marks=rules), "mark"
    )
    assert area == pytest.approx(2 * width, rel=1e-2)


def test_an_arrow_points_along_its_heading(surface_with, assert_watertight):
    size = 'length="4" width="0.6">'
    surface = surface_with(objects("roadMark", size, name="arrowStraight", t=-1.5, hdg=np.pi))
    assert_watertight(surface)
    area, bounds = painted(surface, "mark")
    assert bounds == pytest.approx((48, -1.8, 52, -1.2), abs=2e-3)
    assert 0.5 < area < 1.2
    chosen = np.array([patch.kind == "mark" for patch in surface.patches])[surface.triangle_patch]
    widest = surface.vertices[surface.triangles[chosen]].reshape(-1, 3)
    tip = widest[np.abs(widest[:, 1] + 1.8) < 2e-3, 0]
    assert tip.max() < 50


@pytest.mark.parametrize("length", [1.5, 4.0, 6.0])
@pytest.mark.parametrize(
    "kind",
    [
        "arrowStraight",
        "arrowLeft",
        "arrowRight",
        "arrowLeftRight",
        "arrowStraightLeft",
        "arrowStraightRight",
        "arrowStraightLeftRight",
    ],
)
def test_an_arrow_fills_its_rectangle_and_left_mirrors_right(kind, length):
    shape = arrow(kind, length, 0.9)
    assert shape.is_valid
    assert shape.geom_type == "Polygon"
    assert shape.bounds == pytest.approx((-length / 2, -0.45, length / 2, 0.45))
    swapped = {"Left": "Right", "Right": "Left"}
    other = re.sub("Left|Right", lambda name: swapped[name[0]], kind)
    mirrored = shapely.transform(arrow(other, length, 0.9), lambda points: points * (1, -1))
    assert shape.symmetric_difference(mirrored).area == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "area"), [("narrowPatch", 4 * 0.6), ("SgRMArrow", 0.8), ("arrowstraight", 0.8)]
)
def test_only_words_tell_an_arrow(surface_with, name, area):
    """A mark that shows no arrow fills its rectangle; the arrow's paint is about a third of it."""
    size = 'length="4" width="0.6">'
    painted_area, _ = painted(surface_with(objects("roadMark", size, name=name, t=-1.5)), "mark")
    assert painted_area == pytest.approx(area, rel=0.15)


@pytest.mark.parametrize(
    ("name", "lines"),
    [("SgRMHoldingline-1Lane.flt", 1), ("stop_line_17", 1), ("Haltlinie", 1), ("nonstopliner", 0)],
)
def test_stop_lines_by_name(surface_with, name, lines):
    signal = (
        f'<signal id="1" name="{name}" s="80" t="0" type="-1" subtype="-1" country="OpenDRIVE" '
        'dynamic="no" zOffset="0" orientation="+"/>'
    )
    surface = surface_with(f"<signals>{signal}</signals>")
    assert sum(patch.kind == "mark" for patch in surface.patches) == lines


@pytest.mark.parametrize(
    ("orientation", "low", "high"), [("+", -3, 0), ("-", 0, 3.5), ("none", -3, 3.5)]
)
def test_a_stop_line_spans_the_lanes_it_holds_for(surface_with, orientation, low, high):
    signal = (
        f'<signal id="1" name="" s="80" t="0" type="294" subtype="" country="DE" dynamic="no" '
        f'zOffset="0" orientation="{orientation}"/>'
    )
    area, bounds = painted(surface_with(f"<signals>{signal}</signals>"), "mark")
    assert bounds == pytest.approx((79.8, low, 80.2, high), abs=2e-3)
    assert area == pytest.approx(0.4 * (high - low), rel=1e-2)


def test_a_bay_beside_the_road_is_surface(surface_with, assert_watertight):
    more = 'length="5" width="2.5">'
    surface = surface_with(objects("parkingSpace", more, t=-4.0))
    assert_watertight(surface)
    bay = [patch for patch in surface.patches if patch.lane_type == "parking"]
    assert len(bay) == 1
    area, _ = painted(surface, "parking")
    assert area == pytest.approx(5 * 2.5, rel=1e-2)


PARKING = """<laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
  <lane id="-2" type="parking"><width sOffset="0" a="2.5" b="0" c="0" d="0"/></lane>
  </right></laneSection>"""


def test_a_bay_on_a_parking_lane_is_a_part_of_the_surface(xodr_reader, assert_watertight):
    bay = objects("parkingSpace", 'length="5" width="2">', t=-4.25)
    surface = build_surface(xodr_reader(lanes=PARKING, rest=bay))
    assert_watertight(surface)
    area, bounds = painted(surface, "parking")
    assert area == pytest.approx(10)
    assert bounds == pytest.approx((47.5, -5.25, 52.5, -3.25))
    (patch,) = [patch for patch in surface.patches if patch.kind == "parking"]
    assert (patch.lane_type, patch.origin.id) == ("parking", "7")
    assert painted(surface, "lane", "parking")[0] == pytest.approx(5.5 * 100)


@pytest.mark.parametrize(
    ("type_", "size", "expected"),
    [
        ("roadSurface", 'length="3" width="2"', 6.0),
        ("patch", 'length="3" width="2"', 6.0),
        ("roadSurface", 'radius="0.4"', np.pi * 0.16),
    ],
)
def test_a_repaired_place_is_cut_into_the_lanes(
    surface_with, assert_watertight, type_, size, expected
):
    more = f'{size}><material surface="concrete"/>'
    surface = surface_with(objects(type_, more, t=1.75))
    assert_watertight(surface)
    assert painted(surface, "road_surface")[0] == pytest.approx(expected, rel=0.05)
    (patch,) = [patch for patch in surface.patches if patch.kind == "road_surface"]
    assert (patch.material, patch.origin.tag, patch.origin.number) == ("concrete", "object", 0)
    assert painted(surface, "lane", "mark", "road_surface")[0] == pytest.approx(650)


LINE = '<cornerLocal u="-2" v="0" z="0"/><cornerLocal u="2" v="0" z="0"/>'


@pytest.mark.parametrize(
    ("name", "area", "colour"),
    [
        ("StopLine", 4 * 0.4, "white"),
        ("SolidSingleYellow", 4 * 0.12, "yellow"),
        ("DashedSingleWhite", 3 * 0.12, "white"),
    ],
)
def test_lines_of_named_models_are_painted_along_their_outline(surface_with, name, area, colour):
    surface = surface_with(objects("-1", f"><outline>{LINE}</outline>", name=name, t=-1.5))
    assert painted(surface, "mark")[0] == pytest.approx(area, rel=2e-2)
    assert {patch.colour for patch in surface.patches if patch.kind == "mark"} == {colour}


def test_a_hatched_area_is_half_painted(surface_with, assert_watertight):
    corners = ((-8, -1), (8, -1), (8, 1), (-8, 1))
    outline = "".join(f'<cornerLocal u="{u}" v="{v}" z="0"/>' for u, v in corners)
    region = objects("-1", f"><outline>{outline}</outline>", name="ChevronRegion")
    surface = surface_with(region)
    assert_watertight(surface)
    area, bounds = painted(surface, "mark")
    assert area == pytest.approx(32 / 2, rel=0.1)
    assert 42 <= bounds[0] < 43


@pytest.mark.parametrize(
    ("code", "more", "depth", "low", "high"),
    [
        ("1000003", 'value="3"', 3, -3, 3.5),
        ("1000003", "", 4, -3, 3.5),
        ("293", 'orientation="+"', 4, -3, 3.5),
        ("-1", 'name="SgRMCrosswalk.flt"', 4, -3, 3.5),
        ("-1", 'name="zebra"', 4, -3, 3.5),
    ],
)
def test_a_crosswalk_by_its_signal_spans_the_lanes(  # noqa: PLR0917
    surface_with, assert_watertight, code, more, depth, low, high
):
    signal = f'<signal id="1" s="60" t="0" type="{code}" country="DE" {more}/>'
    surface = surface_with(f"<signals>{signal}</signals>")
    assert_watertight(surface)
    area, bounds = painted(surface, "crosswalk")
    assert area == pytest.approx(depth * (high - low) / 2, rel=0.1)
    assert (bounds[0], bounds[2]) == pytest.approx((60 - depth / 2, 60 + depth / 2))
    assert low <= bounds[1] < low + 0.6
    assert high - 0.6 < bounds[3] <= high


def test_a_crosswalk_of_a_signal_and_of_an_object_is_painted_once(surface_with):
    signal = '<signals><signal id="1" s="50" t="0" type="1000003"/></signals>'
    surface = surface_with(objects("crosswalk", 'length="3" width="6">') + signal)
    origins = {patch.origin.tag for patch in surface.patches if patch.kind == "crosswalk"}
    assert origins == {"object"}


def test_a_crosswalk_at_the_end_of_a_road_moves_onto_it(surface_with):
    signal = '<signals><signal id="1" s="0" t="0" type="1000003" value="4"/></signals>'
    _, bounds = painted(surface_with(signal), "crosswalk")
    assert (bounds[0], bounds[2]) == pytest.approx((0, 4))


@pytest.mark.parametrize(
    ("type_", "kind"),
    [("roadMark", "mark"), ("roadSurface", "road_surface"), ("parkingSpace", "parking")],
)
def test_a_flat_object_is_extruded_along_its_repeat(xodr_reader, assert_watertight, type_, kind):
    """13.2: width and t run linearly; on an arc, the area is that of the annulus."""
    radius = 80.0
    bend = f'<arc curvature="{1 / radius}"/>'
    arc = f'<geometry s="0" x="0" y="0" hdg="0" length="100">{bend}</geometry>'
    repeat = """<repeat s="20" length="40" distance="0" tStart="-1.5" tEnd="-1.5" widthStart="1"
      widthEnd="2" heightStart="0" heightEnd="0" zOffsetStart="0" zOffsetEnd="0"/>"""
    rest = objects(type_, f">{repeat}")
    surface = build_surface(xodr_reader(plan_view=arc, rest=rest))
    assert_watertight(surface)
    expected = 40 * 1.5 * (radius + 1.5) / radius
    assert painted(surface, kind)[0] == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(("orientation", "foot"), [("+", 57.5), ("-", 62.5)])
def test_an_arrow_of_a_signal_points_along_its_traffic(surface_with, orientation, foot):
    given = f'name="SgRMArrowStraight.flt" orientation="{orientation}"'
    signal = f'<signal id="1" s="60" t="1.5" type="-1" {given}/>'
    surface = surface_with(f"<signals>{signal}</signals>")
    area, bounds = painted(surface, "mark")
    assert 0.5 < area < 2
    assert (bounds[0], bounds[2]) == pytest.approx((57.5, 62.5))
    chosen = np.array([patch.kind == "mark" for patch in surface.patches])[surface.triangle_patch]
    points = surface.vertices[surface.triangles[chosen]].reshape(-1, 3)
    broad = points[np.abs(points[:, 1] - 1.5) > 0.2, 0]
    assert (np.abs(broad - foot) > 2.5).all()


def test_paint_stays_on_the_road(surface_with, assert_watertight):
    size = 'length="0.5" width="4">'
    surface = surface_with(objects("roadMark", size, name="stopLine", t=3.5))
    assert_watertight(surface)
    assert painted(surface, "mark")[0] == pytest.approx(0.5 * 2, rel=1e-2)
    assert painted(surface, "lane", "mark")[0] == pytest.approx(650)


def test_a_cross_path_is_a_zebra_over_the_lanes(network_of, road_xml, assert_watertight):
    walk = (
        '<laneSection s="0"><center><lane id="0" type="none"/></center><right>'
        '<lane id="-1" type="walking"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>'
        "</right></laneSection>"
    )
    across = '<geometry s="0" x="50" y="-6" hdg="1.57079632679" length="12"><line/></geometry>'
    crossing = road_xml("2", length="12", lanes=walk, plan_view=across)
    junction = (
        '<junction id="9" name="" type="virtual" mainRoad="1" sStart="48" sEnd="54">'
        '<crossPath id="0" crossingRoad="2" roadAtStart="1" roadAtEnd="1"/></junction>'
    )
    surface = build_surface(network_of(road_xml() + crossing + junction))
    assert_watertight(surface)
    (number,) = [k for k, patch in enumerate(surface.patches) if patch.kind == "crosswalk"]
    corners = surface.vertices[surface.triangles[surface.triangle_patch == number]]
    assert (corners[..., 0].min(), corners[..., 0].max()) == pytest.approx((50, 53))
    assert corners[..., 1].min() >= -3.001
    assert corners[..., 1].max() <= 3.501
    marked = '<object id="1" type="crosswalk" s="51.5" t="0" length="3" width="6"/>'
    main = road_xml(rest=f"<objects>{marked}</objects>")
    surface = build_surface(network_of(main + crossing + junction))
    (only,) = [patch.id for patch in surface.patches if patch.kind == "crosswalk"]
    assert only.startswith("object_1_0_")


def test_a_traffic_island_is_a_raised_part_of_the_surface(network_of, road_xml, assert_watertight):
    places = ((40, -1), (60, -1), (60, 1), (40, 1))
    corners = "".join(
        f'<cornerRoad id="{k}" s="{s}" t="{t}" dz="0" height="0.12"/>'
        for k, (s, t) in enumerate(places)
    )
    island = (
        '<objects><object id="1" type="trafficIsland" s="50" t="0"><outlines>'
        f'<outline id="0" fillType="cobble" closed="true">{corners}</outline></outlines>'
        "</object></objects>"
    )
    surface = build_surface(network_of(road_xml(rest=island)))
    assert_watertight(surface)
    kinds = np.array([patch.kind for patch in surface.patches])[surface.triangle_patch]
    top = surface.vertices[surface.triangles[kinds == "island"]]
    normal = np.cross(top[:, 1] - top[:, 0], top[:, 2] - top[:, 0])
    assert np.linalg.norm(normal, axis=1).sum() / 2 == pytest.approx(40)
    assert np.unique(top[..., 2]) == pytest.approx([0.12])
    kerb = surface.vertices[surface.triangles[kinds == "kerb"]]
    normal = np.cross(kerb[:, 1] - kerb[:, 0], kerb[:, 2] - kerb[:, 0])
    assert np.linalg.norm(normal, axis=1).sum() / 2 == pytest.approx(44 * 0.12)
