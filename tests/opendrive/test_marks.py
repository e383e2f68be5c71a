"""Road marks: dashes, double lines, explicit lines, sway."""

import numpy as np
import pytest

from envgen_usd.opendrive.marks import mark_strips
from envgen_usd.opendrive.strips import section_grids

SECTION = """
<laneSection s="0">
  <center><lane id="0" type="none">{centre}</lane></center>
  <right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>{right}</lane>
  </right>
</laneSection>"""


@pytest.fixture
def marks(xodr_reader):
    def make(centre="", right="", rest=""):
        network = xodr_reader(lanes=SECTION.format(centre=centre, right=right), rest=rest)
        road = next(iter(network.roads.values()))
        (grid,) = section_grids(road, 0.02)
        return list(mark_strips(grid))

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


@pytest.mark.parametrize(("weight", "width"), [("standard", 0.12), ("bold", 0.25)])
def test_the_weight_gives_the_width(marks, weight, width):
    (strip,) = marks(right=f'<roadMark sOffset="0" type="solid" weight="{weight}"/>')
    assert np.ptp(extent(strip)[2:]) == pytest.approx(width)


def test_broken_marks_have_dashes(marks):
    found = [extent(strip) for strip in marks(centre='<roadMark sOffset="0" type="broken"/>')]
    assert found[0][:2] == (0, 3)
    assert found[1][:2] == (9, 12)
    assert len(found) == 12
    assert found[-1][1] <= 100


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
