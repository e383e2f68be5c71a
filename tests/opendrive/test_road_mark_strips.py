"""Road marks: dashes, double lines, explicit lines, sway."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.opendrive.geometry.section_grids import section_grids
from envgen_usd.opendrive.inspect.map_shapes import map_shapes
from envgen_usd.opendrive.strips.road_mark_strips import mark_strips
from envgen_usd.opendrive.surface import build_surface

SECTION = """
<laneSection s="0">
  <center><lane id="0" type="none">{centre}</lane></center>
  <right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>{right}</lane>
  </right>
</laneSection>"""
COUNTRY = MarkRules(
    width=0.1, dash_length=3.05, dash_gap=9.14, motorway_dash_length=4.0, motorway_dash_gap=5.0
)


@pytest.fixture
def marks(xodr_reader):
    def make(centre="", right="", rest="", rules=RMS_MARKS):
        network = xodr_reader(lanes=SECTION.format(centre=centre, right=right), rest=rest)
        road = next(iter(network.roads.values()))
        (grid,) = section_grids([road], 0.02)
        return list(mark_strips(grid, rules))

    return make


def extent(strip):
    """(start x, end x, lowest y, highest y) of a mark on a road along +x."""
    points = np.concatenate([strip.left, strip.right])
    low, high = points.min(axis=0), points.max(axis=0)
    return tuple(np.round([low[0], high[0], low[1], high[1]], 6).tolist())


def test_a_solid_mark_is_centred_on_the_outer_border(marks):
    found = marks(right='<roadMark sOffset="0" type="solid" width="0.2" color="yellow"/>')
    assert [extent(strip) for strip in found] == [(0, 100, -3.1, -2.9)]
    assert found[0].patch.colour == "yellow"
    assert found[0].patch.lane == -1


KERBED = """
<laneSection s="0">
  <left><lane id="1" type="sidewalk"><width sOffset="0" a="2" b="0" c="0" d="0"/>{left}</lane>
  </left>
  <center><lane id="0" type="none"><roadMark sOffset="0" type="solid" width="0.2"/></lane></center>
  <right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>{mark}</lane>
  <lane id="-2" type="sidewalk"><width sOffset="0" a="2" b="0" c="0" d="0"/>{right}</lane></right>
</laneSection>"""
RAISED = '<height sOffset="0" inner="0.12" outer="0.12"/>'
SOLID = '<roadMark sOffset="0" type="solid" width="0.2"/>'
DOUBLE = '<roadMark sOffset="0" type="solid solid" width="0.1"/>'


@pytest.mark.parametrize(
    ("left", "right", "mark", "expected"),
    [
        ("", "", SOLID, [(-0.1, 0.1), (-3.1, -2.9)]),
        (RAISED, "", SOLID, [(-0.2, 0), (-3.1, -2.9)]),
        ("", RAISED, SOLID, [(-0.1, 0.1), (-3, -2.8)]),
        (RAISED, RAISED, DOUBLE, [(-0.2, 0), (-2.8, -2.7), (-3, -2.9)]),
    ],
)
def test_a_mark_at_a_kerb_lies_at_its_foot(xodr_reader, left, right, mark, expected):
    network = xodr_reader(lanes=KERBED.format(left=left, right=right, mark=mark))
    (grid,) = section_grids([next(iter(network.roads.values()))], 0.02)
    found = sorted((extent(strip)[2:] for strip in mark_strips(grid)), reverse=True)
    assert found == expected


def test_a_mark_that_begins_between_rows_lies_at_the_kerb_s_foot(xodr_reader):
    mark = SOLID.replace('"0"', '"20"') + '<roadMark sOffset="60" type="none"/>'
    network = xodr_reader(lanes=KERBED.format(left="", right=RAISED, mark=mark))
    (grid,) = section_grids([next(iter(network.roads.values()))], 0.02)
    found = [extent(strip) for strip in mark_strips(grid) if strip.patch.lane == -1]
    assert found == [(20, 60, -3, -2.8)]


def test_no_paint_lies_on_a_kerb(xodr_reader):
    lanes = KERBED.format(left=RAISED, right=RAISED, mark=SOLID)
    surface = build_surface(xodr_reader(lanes=lanes))
    kinds = np.array([patch.kind for patch in surface.patches])[surface.triangle_patch]
    assert np.ptp(surface.vertices[surface.triangles[kinds == "mark"]][..., 2]) == 0.0
    kerbs = {patch.lane_type for patch in surface.patches if patch.kind == "kerb"}
    assert kerbs == {"sidewalk"}


def widths(strips):
    """Different widths of strips across the road, ascending."""
    return sorted({round(float(np.ptp(extent(strip)[2:])), 6) for strip in strips})


@pytest.mark.parametrize(
    ("weight", "rules", "width"),
    [
        ('weight="standard"', RMS_MARKS, 0.12),
        ('weight="bold"', RMS_MARKS, 0.24),
        ("", RMS_MARKS, 0.12),
        ('weight="standard"', COUNTRY, 0.1),
        ('weight="bold"', COUNTRY, 0.2),
        ('weight="bold" width="-1"', COUNTRY, 0.2),
        ('weight="bold" width="0.15"', COUNTRY, 0.15),
    ],
)
def test_the_file_gives_the_width_or_else_the_environment(marks, weight, rules, width):
    mark = f'<roadMark sOffset="0" type="solid" {weight}/>'
    assert widths(marks(right=mark, rules=rules)) == [width]


def test_bold_double_lines_are_two_bold_lines(marks):
    """Only a width of the file is that of both lines together; wide paint stays a line's width."""
    wide = replace(COUNTRY, width=0.2)
    mark = '<roadMark sOffset="0" type="solid solid" weight="bold"/>'
    found = [extent(strip)[2:] for strip in marks(right=mark, rules=wide)]
    assert sorted(found) == [(-3.6, -3.2), (-2.8, -2.4)]
    given = mark.replace("weight", 'width="0.6" weight')
    assert widths(marks(right=given, rules=wide)) == [0.2]


def test_broken_marks_have_dashes(marks):
    found = [extent(strip) for strip in marks(centre='<roadMark sOffset="0" type="broken"/>')]
    assert found[0][:2] == (0, 3)
    assert found[1][:2] == (9, 12)
    assert len(found) == 12
    assert found[-1][1] <= 100


TOWN, MOTORWAY = (f'<type s="0" type="{k}"/>' for k in ("town", "motorway"))


@pytest.mark.parametrize(
    ("kind", "rules", "dash", "gap"),
    [
        (TOWN, RMS_MARKS, 3, 6),
        (MOTORWAY, RMS_MARKS, 6, 12),
        ("", COUNTRY, 3.05, 9.14),
        (TOWN, COUNTRY, 3.05, 9.14),
        (MOTORWAY, COUNTRY, 4, 5),
        (MOTORWAY + TOWN.replace('s="0"', 's="50"'), COUNTRY, 4, 5),
    ],
)
def test_dashes_are_those_of_the_environment(marks, kind, rules, dash, gap):
    found = marks(centre='<roadMark sOffset="0" type="broken"/>', rest=kind, rules=rules)
    begins = [extent(strip)[0] for strip in found]
    assert np.diff(begins) == pytest.approx(dash + gap)
    assert extent(found[0])[1] == pytest.approx(dash)


def test_lines_of_the_file_win_over_the_dashes_of_the_environment(marks):
    line = '<line length="2" space="8" tOffset="0" sOffset="0" width="{width}"/>'
    mark = '<roadMark sOffset="0" type="broken" weight="bold"><type name="x">{}</type></roadMark>'
    found = marks(right=mark.format(line.format(width=0.3)), rules=COUNTRY)
    assert [extent(strip)[:2] for strip in found[:2]] == [(0, 2), (10, 12)]
    assert widths(found) == [0.3]
    # A line without a width has that of its mark.
    bare = marks(right=mark.format(line.replace(' width="{width}"', "")), rules=COUNTRY)
    assert widths(bare) == [0.2]


def test_surface_layers_and_map_follow_the_environment(network_of, road_xml):
    """A broken mark of the permanent lanes, and a solid one of a temporary layer."""
    permanent = SECTION.format(centre='<roadMark sOffset="0" type="broken"/>', right="")
    works = SECTION.format(centre="", right='<roadMark sOffset="0" type="solid" weight="bold"/>')
    network = network_of(road_xml(lanes=f'{permanent}</lanes><lanes layer="works">{works}'))
    whole = (8 * 3.05 + 100 - 8 * 12.19) * 0.1 + 100 * 0.2
    surface = build_surface(network, marks=COUNTRY)
    painted = np.array([patch.kind == "mark" for patch in surface.patches])
    corners = surface.vertices[surface.triangles[painted[surface.triangle_patch]], :2]
    # The borders of the only lane are those of the road, which end the surface.
    assert shapely.area(shapely.polygons(corners)).sum() == pytest.approx(whole / 2, rel=1e-3)
    drawn = [shape.points for shape in map_shapes(network, COUNTRY) if shape.kind == "paint"]
    assert shapely.area([*map(shapely.Polygon, drawn)]).sum() == pytest.approx(whole)


def test_lines_of_the_type_repeat(marks):
    line = '<line length="2" space="8" tOffset="0.5" sOffset="1" width="0.3"/>'
    mark = (
        f'<roadMark sOffset="20" type="broken"><type name="x" width="0.3">{line}</type></roadMark>'
    )
    found = [extent(strip) for strip in marks(right=mark)]
    assert found[0] == (21, 23, -2.65, -2.35)
    assert [start for start, *_ in found] == [21, 31, 41, 51, 61, 71, 81, 91]


def test_explicit_lines_do_not_repeat(marks):
    lines = "".join(
        f'<line length="{size}" tOffset="0" sOffset="{start}" width="0.1"/>'
        for start, size in ((0, 5), (40, 10))
    )
    mark = f'<roadMark sOffset="10" type="custom"><explicit>{lines}</explicit></roadMark>'
    assert [extent(strip)[:2] for strip in marks(right=mark)] == [(10, 15), (50, 60)]


def test_double_lines_lie_side_by_side_from_the_inside_outwards(marks):
    found = marks(right='<roadMark sOffset="0" type="solid broken" width="0.1"/>')
    solid = [extent(strip) for strip in found if extent(strip)[1] == 100 and extent(strip)[0] == 0]
    assert solid == [(0, 100, -2.95, -2.85)]
    broken = extent(next(strip for strip in found if extent(strip)[1] == 3))
    assert broken == (0, 3, -3.15, -3.05)


def test_on_the_centre_lane_double_lines_go_from_left_to_right(marks):
    found = marks(centre='<roadMark sOffset="0" type="broken solid" width="0.1"/>')
    solid = next(strip for strip in found if extent(strip)[1] == 100 and extent(strip)[0] == 0)
    assert extent(solid)[2:] == (-0.15, -0.05)


def test_a_mark_ends_where_the_next_one_begins(marks):
    right = '<roadMark sOffset="0" type="solid"/><roadMark sOffset="30" type="none"/>'
    assert [extent(strip)[:2] for strip in marks(right=right)] == [(0, 30)]


def test_sway_moves_the_mark_sideways(marks):
    sway = '<sway ds="0" a="0" b="0.01" c="0" d="0"/>'
    mark = f'<roadMark sOffset="0" type="solid" width="0.1">{sway}</roadMark>'
    (strip,) = marks(right=mark)
    np.testing.assert_allclose(strip.left[[0, -1], 1], [-2.95, -1.95], atol=1e-6)


def test_what_is_no_paint_makes_no_mark(marks):
    for kind in ("none", "curb", "grass", "edge"):
        assert not marks(right=f'<roadMark sOffset="0" type="{kind}"/>')
