"""No edge of the surface is further from the road's curves than the tolerance."""

import numpy as np
import pytest

from envgen_usd.opendrive.geometry.lane_borders import lane_borders, section_points
from envgen_usd.opendrive.geometry.row_sampling import section_rows
from envgen_usd.opendrive.geometry.section_grids import inside_section, section_grids
from envgen_usd.opendrive.reader import read_network

CURVES = {
    "arc": '<geometry s="0" x="0" y="0" hdg="0" length="100"><arc curvature="0.03"/></geometry>',
    "spiral": '<geometry s="0" x="0" y="0" hdg="0" length="100">'
    '<spiral curvStart="-0.01" curvEnd="0.08"/></geometry>',
    "paramPoly3": '<geometry s="0" x="0" y="0" hdg="0" length="100"><paramPoly3 aU="0" bU="90" '
    'cU="0" dU="0" aV="0" bV="0" cV="90" dV="-60" pRange="normalized"/></geometry>',
    # Its curvature rises to 0.13 1/m at the end, where a line follows (Issue295a, road 851).
    "tightening": '<geometry s="0" x="0" y="0" hdg="0" length="9.06318981"><paramPoly3 aU="0" '
    'bU="6.76820658" cU="7.14887531" dU="-4.92719442" aV="0" bV="0" cV="0.15182552" '
    'dV="-0.93889001" pRange="normalized"/></geometry><geometry s="9.06318981" x="8.98988747" '
    'y="-0.78706449" hdg="-0.380406154" length="40"><line/></geometry>',
}
WAVES = '<elevation s="0" a="0" b="0" c="0.01" d="-0.0001"/>'
WIDENING = """
<laneOffset s="0" a="0" b="0" c="0.001" d="0"/>
<laneSection s="0">
  <left><lane id="1" type="driving"><width sOffset="0" a="2" b="0" c="0" d="0"/>
    <width sOffset="33.3" a="2" b="0" c="0.003" d="-0.00003"/></lane></left>
  <center><lane id="0" type="none"/></center>
  <right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
</laneSection>"""


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("tolerance", [0.1, 0.02, 0.002])
@pytest.mark.parametrize("more", [{}, {"elevation": WAVES}, {"lanes": WIDENING}])
def test_chords_stay_within_the_tolerance(xodr_reader, curve, tolerance, more):
    road = next(iter(xodr_reader(plan_view=CURVES[curve], **more).roads.values()))
    section = road.sections[0]
    rows = section_rows(road, section, tolerance)
    assert (np.diff(rows) > 0).all()
    assert (rows[0], rows[-1]) == (section.s, section.end)
    dense = np.linspace(rows[0], rows[-1] - 1e-9, 20_001)
    t = lane_borders(road, section, dense).t
    curve_points = section_points(road, section, dense, t)
    on_rows = np.minimum(rows, rows[-1] - 1e-9)
    at_rows = section_points(road, section, on_rows, lane_borders(road, section, on_rows).t)
    nearest = np.searchsorted(rows, dense, side="right").clip(1, len(rows) - 1)
    start, end = at_rows[nearest - 1], at_rows[nearest]
    along = end - start
    part = ((curve_points - start) * along).sum(-1) / (along**2).sum(-1)
    off = np.linalg.norm(start + part[..., None] * along - curve_points, axis=-1)
    assert off.max() < tolerance + 1e-5


def test_a_straight_road_needs_few_rows(xodr_reader):
    road = next(iter(xodr_reader().roads.values()))
    assert len(section_rows(road, road.sections[0], 0.001)) <= 3


def test_rows_grow_with_the_root_of_the_tolerance(xodr_reader):
    road = next(iter(xodr_reader(plan_view=CURVES["arc"]).roads.values()))
    coarse, fine = (len(section_rows(road, road.sections[0], size)) for size in (0.04, 0.0004))
    assert 8 < fine / coarse < 12


def test_knots_without_effect_give_no_rows(xodr_reader):
    """A straight road in 400 geometries with as many heights needs no more rows than one."""
    geometries = "".join(
        f'<geometry s="{k / 4}" x="{k / 4}" y="0" hdg="0" length="0.25"><line/></geometry>'
        for k in range(400)
    )
    heights = "".join(
        f'<elevation s="{k / 4 + 0.01}" a="{0.02 * (k / 4 + 0.01)}" b="0.02" c="0" d="0"/>'
        for k in range(400)
    )
    road = next(iter(xodr_reader(plan_view=geometries, elevation=heights).roads.values()))
    assert len(section_rows(road, road.sections[0], 0.02)) <= 5


def test_a_kerb_that_begins_has_its_row(xodr_reader):
    kerb = '<height sOffset="0" inner="0" outer="0"/><height sOffset="40" inner="0.1" outer="0.1"/>'
    lanes = WIDENING.replace('c="0" d="0"/></lane></right>', f'c="0" d="0"/>{kerb}</lane></right>')
    road = next(iter(xodr_reader(lanes=lanes).roads.values()))
    assert 40.0 in section_rows(road, road.sections[0], 0.02)


@pytest.mark.parametrize("name", ["scenic/Town04_0910", "esmini/tilted_crest"])
def test_all_sections_at_once_are_those_of_each_alone(corpus, name):
    roads = read_network(corpus / f"{name}.xodr").roads.values()
    grids = section_grids(roads, 0.02)
    sections = [(road, section) for road in roads for section in road.sections]
    assert [grid.section for grid in grids] == [section for _, section in sections]
    for grid, (road, section) in zip(grids, sections, strict=True):
        s = inside_section(section, section_rows(road, section, 0.02))
        alone = lane_borders(road, section, s)
        np.testing.assert_allclose(grid.borders.s, s, atol=1e-9)
        np.testing.assert_allclose(grid.borders.t, alone.t, atol=1e-12)
        np.testing.assert_allclose(grid.borders.height_left, alone.height_left, atol=1e-12)
        np.testing.assert_allclose(grid.borders.height_right, alone.height_right, atol=1e-12)
        points = section_points(road, section, s, alone.t)
        np.testing.assert_allclose(grid.points, points, atol=1e-9)
