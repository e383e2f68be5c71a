"""Road coordinates: slope, superelevation, lateral profiles, level lanes."""

import numpy as np
import pytest

from envgen_usd.opendrive.geometry.lane_borders import lane_borders, section_points
from envgen_usd.opendrive.geometry.road_frame import road_points

ELEVATION = '<elevation s="0" a="2" b="0.1" c="0" d="0"/>'


def only_road(network):
    return next(iter(network.roads.values()))


def test_slope_lifts_and_tilts_the_height_axis(xodr_reader):
    road = only_road(xodr_reader(elevation=ELEVATION))
    points = road_points(road, np.array([50.0]), 0.0, np.array([0.0]))
    np.testing.assert_allclose(points, [[50.0, 0.0, 7.0]])
    lifted = road_points(road, np.array([50.0]), 0.0, 1.0)
    normal = np.array([-0.1, 0.0, 1.0]) / np.hypot(0.1, 1.0)
    np.testing.assert_allclose(lifted - points, normal[None])


def test_superelevation_rotates_the_cross_section(xodr_reader):
    angle = np.radians(10)
    road = only_road(xodr_reader(lateral=f'<superelevation s="0" a="{angle}" b="0" c="0" d="0"/>'))
    points = road_points(road, np.zeros(2), np.array([4.0, -4.0]))
    expected = [
        [0, 4 * np.cos(angle), 4 * np.sin(angle)],
        [0, -4 * np.cos(angle), -4 * np.sin(angle)],
    ]
    np.testing.assert_allclose(points, expected, atol=1e-12)


def test_shape_is_added_to_superelevation_and_interpolated(xodr_reader):
    shapes = "".join(
        f'<shape s="{s}" t="{t}" a="{a}" b="{b}" c="0" d="0"/>'
        for s, t, a, b in ((0, -5, 0, 0.1), (0, 0, 0.5, -0.1), (100, -5, 0, 0))
    )
    road = only_road(
        xodr_reader(lateral='<superelevation s="0" a="0" b="0" c="0" d="0"/>' + shapes)
    )
    t = np.array([-5.0, -2.0, 0.0, 3.0])
    at_start = road_points(road, np.zeros(4), t)
    np.testing.assert_allclose(at_start[:, 2], [0.0, 0.3, 0.5, 0.2], atol=1e-12)
    half = road_points(road, np.full(4, 50.0), t)
    np.testing.assert_allclose(half[:, 2], [0.0, 0.15, 0.25, 0.1], atol=1e-12)


def test_level_lanes_do_not_tilt(xodr_reader):
    angle = 0.1
    lanes = """
    <laneSection s="0">
      <center><lane id="0" type="none"/></center>
      <right>
        <lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
        <lane id="-2" type="sidewalk" level="true">
          <width sOffset="0" a="2" b="0" c="0" d="0"/></lane>
      </right>
    </laneSection>"""
    road = only_road(
        xodr_reader(lateral=f'<superelevation s="0" a="{angle}" b="0" c="0" d="0"/>', lanes=lanes)
    )
    borders = lane_borders(road, road.sections[0], np.array([10.0]))
    points = section_points(road, road.sections[0], borders.s, borders.t)[0]
    drop = -3 * np.sin(angle)
    np.testing.assert_allclose(points[:, 2], [0, drop, drop], atol=1e-12)
    assert points[2, 1] == pytest.approx(-3 * np.cos(angle) - 2)


def test_heights_change_between_inner_and_outer_border(xodr_reader):
    lanes = """
    <laneSection s="0">
      <left><lane id="1" type="sidewalk"><width sOffset="0" a="2" b="0" c="0" d="0"/>
        <height sOffset="0" inner="0.1" outer="0.2"/>
        <height sOffset="50" inner="0.3" outer="0.4"/></lane></left>
      <center><lane id="0" type="none"/></center>
    </laneSection>"""
    road = only_road(xodr_reader(lanes=lanes))
    borders = lane_borders(road, road.sections[0], np.array([0.0, 49.0, 50.0]))
    np.testing.assert_allclose(borders.height_left[:, 0], [0.2, 0.2, 0.4])
    np.testing.assert_allclose(borders.height_right[:, 0], [0.1, 0.1, 0.3])
