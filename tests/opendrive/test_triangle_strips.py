"""Triangles of an area have the heights of its ring and cover it once."""

import numpy as np
import shapely

from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.strips.triangle_strips import ring_strips, triangle_strips

PATCH = Patch(id="bay", kind="parking", lane_type="parking")


def star(corners: int = 14) -> np.ndarray:
    angle = np.linspace(0.0, 2 * np.pi, corners, endpoint=False)
    radius = np.where(np.arange(corners) % 2, 4.0, 10.0)
    height = np.arange(corners) / 8
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])


def area_of(strip) -> float:
    (x, y), (u, v) = strip.left[1, :2] - strip.left[0, :2], strip.right[1, :2] - strip.left[0, :2]
    return (u * y - v * x) / 2


def test_corners_keep_their_heights_and_cover_the_area():
    ring = star()
    strips = list(ring_strips(ring, 0.1, PATCH, heights=2 * ring[:, 2]))
    assert len(strips) == len(ring) - 2
    assert np.isclose(sum(map(area_of, strips)), shapely.Polygon(ring).area)
    places = {tuple(corner) for corner in ring.tolist()}
    for strip in strips:
        for side, border in enumerate((strip.left, strip.right)):
            assert {tuple(corner) for corner in border.tolist()} <= places
            np.testing.assert_array_equal(strip.height[:, side], 2 * border[:, 2])


def test_a_ring_either_way_round_gives_triangles_of_positive_area():
    for ring in (star(), star()[::-1]):
        assert all(area_of(strip) > 0 for strip in ring_strips(ring, 0.1, PATCH))


def test_a_ring_that_is_small_or_crosses_itself_has_no_area():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert not list(ring_strips(square, 1.1, PATCH))
    assert not list(ring_strips(square[[0, 2, 1, 3]], 0.0, PATCH))


def test_triangles_without_heights_lie_on_the_road():
    corners = np.array([[[0.0, 0, 5], [0, 1, 6], [1, 0, 7]]])
    (strip,) = triangle_strips(corners, PATCH)
    assert area_of(strip) == 0.5
    assert not strip.height.any()
    assert not strip.depth.any()
