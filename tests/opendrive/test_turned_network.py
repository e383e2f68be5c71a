"""The heading of the header's offset turns the whole map (8.5)."""

import numpy as np
import pytest

from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.geometry.road_frame import road_points
from envgen_usd.opendrive.surface import build_surface

HEAD = (
    '<header revMajor="1" revMinor="8"><offset x="454000" y="5411000" z="100" hdg="{}"/></header>'
)
SIGNAL = """<signals><signal id="1" s="20" t="-6" orientation="+" type="274" country="DE"
  zOffset="2" height="0.6" width="0.6" dynamic="no">
  <positionInertial x="30" y="-7" z="2" hdg="0.2"/></signal></signals>"""
PLAN = '<geometry s="0" x="10" y="20" hdg="0.3" length="100"><arc curvature="0.01"/></geometry>'


def turn(points, angle):
    """Rotation around the z axis, written out."""
    x, y = points[..., 0], points[..., 1]
    turned = x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)
    return np.stack([*turned, points[..., 2]], axis=-1)


@pytest.mark.parametrize("angle", [0.5, -2.0])
def test_the_road_is_turned_around_the_origin_and_then_moved(network_of, road_xml, angle):
    xml = road_xml(plan_view=PLAN, rest=SIGNAL)
    plain = network_of(xml, head=HEAD.format(0))
    network = network_of(xml, head=HEAD.format(angle))
    s = np.linspace(0, 100, 21)
    there = road_points(network.roads["1"], s, 3.0)
    np.testing.assert_allclose(there, turn(road_points(plain.roads["1"], s, 3.0), angle))
    # Closed form: a circle of 100 m to the left of (10, 20), first along 0.3 rad.
    middle = np.array([10 - 100 * np.sin(0.3), 20 + 100 * np.cos(0.3), 0])
    np.testing.assert_allclose(np.linalg.norm(there - turn(middle, angle), axis=1), 97)
    surface = build_surface(network)
    assert surface.offset == (454000, 5411000, 100)
    (sign,) = road_features(network)
    (before,) = road_features(plain)
    shift = sign.pose.position - turn(before.pose.position, angle)
    assert np.abs(shift).max() < 0.002
    difference = sign.pose.heading - before.pose.heading - angle
    assert np.cos(difference) == pytest.approx(1)
