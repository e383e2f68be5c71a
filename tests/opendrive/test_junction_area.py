"""Junctions with a boundary and with an elevation grid of their own."""

import numpy as np
import pytest

from envgen_usd.opendrive.geometry.elevation_grid import grid_heights
from envgen_usd.opendrive.surface import build_surface

LANE = '<lane id="{}" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>'
LANES = f"""<laneSection s="0"><left>{LANE.format(1)}</left><center><lane id="0" type="none"/>
</center><right>{LANE.format(-1)}</right></laneSection>"""
PLACES = {"1": (-20, 0, 0), "2": (20, 0, np.pi), "3": (0, -20, np.pi / 2)}


def arms(road_xml):
    """Three roads of 10 m that end 10 m from the origin: west, east, south."""
    roads = ""
    for name, (x, y, heading) in PLACES.items():
        line = f'<geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="10"><line/></geometry>'
        link = '<successor elementType="junction" elementId="9"/>'
        roads += road_xml(name, length="10", plan_view=line, lanes=LANES, link=link)
    return roads


def through(road_xml):
    line = '<geometry s="0" x="-10" y="0" hdg="0" length="20"><line/></geometry>'
    return road_xml("7", length="20", attributes='junction="9"', plan_view=line, lanes=LANES)


def area(surface):
    corners = surface.vertices[surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normal[:, 2].sum() / 2


def test_the_boundary_is_the_area_of_the_junction(network_of, road_xml, assert_watertight):
    segments = """
    <segment type="joint" roadId="1" contactPoint="end"/>
    <segment type="joint" roadId="3" contactPoint="end"/>
    <segment type="joint" roadId="2" contactPoint="end"/>
    <segment type="lane" roadId="7" boundaryLane="1" sStart="end" sEnd="begin"/>"""
    junction = f'<junction id="9" name=""><boundary>{segments}</boundary></junction>'
    surface = build_surface(network_of(arms(road_xml) + through(road_xml) + junction))
    assert_watertight(surface)
    corners = [(-10, 3), (-10, -3), (-3, -10), (3, -10), (10, -3), (10, 3)]
    x, y = np.array(corners, dtype=float).T
    inside = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2
    assert area(surface) == pytest.approx(3 * 60 + inside, rel=1e-6)
    assert len(surface.outline) == 1


GRID = """<junction id="9" name="">
<planView><geometry s="0" x="-10" y="0" hdg="0" length="20"><line/></geometry></planView>
<elevationGrid gridSpacing="5">
<elevation center="0" left="0 0" right="0 0"/>
<elevation center="1" left="0.5 0" right="0.6 0"/>
<elevation center="2" left="1 0" right="1 0"/>
<elevation center="1" left="0.5 0" right="0.6 0"/>
<elevation center="0" left="0 0" right="0 0"/>
</elevationGrid></junction>"""


def test_the_grid_is_bilinear(network_of, road_xml):
    junction = network_of(through(road_xml) + GRID).junctions["9"]
    points = np.array([[-10, 0], [0, 0], [-5, 5], [-5, -5], [-2.5, 0], [0, 2.5], [30, 0], [0, 40]])
    expected = [0, 2, 0.5, 0.6, 1.5, 1.5, np.nan, np.nan]
    np.testing.assert_allclose(grid_heights(junction, points.astype(float)), expected)


def test_the_grid_ends_at_the_ends_of_its_reference_line(network_of, road_xml):
    junction = network_of(through(road_xml) + GRID).junctions["9"]
    points = np.array([[-10.4, 0], [-12, 2], [-9.9, 0], [9.9, 0], [10.4, 0], [12, -2]])
    expected = [np.nan, np.nan, 0.02, 0.02, np.nan, np.nan]
    np.testing.assert_allclose(grid_heights(junction, points), expected, atol=1e-9)


@pytest.mark.parametrize("turn", [1, -1])
def test_rows_of_the_grid_lie_across_a_bent_reference_line(network_of, road_xml, turn):
    """On an arc around (-10, +-20), s is the angle times 20 m and t the distance from the arc."""
    bent = GRID.replace("<line/>", f'<arc curvature="{turn * 0.05}"/>')
    junction = network_of(through(road_xml) + bent).junctions["9"]
    s, t = (each.ravel() for each in np.meshgrid([1.2, 3.3, 5.0, 9.1, 16.0], [-4.0, 0, 3.0]))
    angle, radius = s / 20, 20 - turn * t
    x, y = radius * np.sin(angle) - 10, turn * (20 - radius * np.cos(angle))
    ridge = np.interp(s, [0, 5, 10, 15, 20], [0, 1, 2, 1, 0])
    beside = np.interp(s, [0, 5, 10, 15, 20], [0, 0.5, 1, 0.5, 0])
    right = np.interp(s, [0, 5, 10, 15, 20], [0, 0.6, 1, 0.6, 0])
    expected = ridge + np.abs(t) / 5 * (np.where(t > 0, beside, right) - ridge)
    # Chords of 0.5 m turn by 0.025 rad: at 4 m beside them, s is true within 5 cm.
    heights = grid_heights(junction, np.column_stack([x, y]))
    np.testing.assert_allclose(heights, expected, atol=0.2 * 0.05 + 1e-3)


def test_the_grid_lifts_the_junction_and_meets_its_arms(network_of, road_xml, assert_watertight):
    surface = build_surface(network_of(arms(road_xml) + through(road_xml) + GRID))
    assert_watertight(surface)
    inside = np.abs(surface.vertices[:, 0]) < 9.9
    assert surface.vertices[~inside, 2].max() == 0.0
    assert surface.vertices[inside, 2].max() > 0.5


def test_the_surface_follows_the_grid_between_its_points(network_of, road_xml):
    network = network_of(arms(road_xml) + through(road_xml) + GRID)
    surface = build_surface(network)
    inside = np.abs(surface.vertices[:, 0]) < 9.9
    inside &= np.abs(surface.vertices[:, 1]) < 2.9
    points = surface.vertices[inside]
    assert len(points) >= 3
    expected = grid_heights(network.junctions["9"], points[:, :2])
    np.testing.assert_allclose(points[:, 2], expected, atol=1e-3)
