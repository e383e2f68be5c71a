"""The index of strips has all strips near a point, as an exact distance says."""

import numpy as np
import pytest
import shapely

from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.strips import strip_index
from envgen_usd.opendrive.strips.strip_index import Cells
from envgen_usd.opendrive.strips.triangle_strips import triangle_strips


def some_strips(count: int, flatness: float) -> list:
    random = np.random.default_rng(5)
    corners = random.uniform(0.0, 10.0, (count, 3, 3))
    corners[..., 1] *= flatness
    patch = Patch(id="lane", kind="lane", lane_type="driving")
    return list(triangle_strips(corners, patch))


@pytest.mark.parametrize("at_a_time", [300, 1 << 15])
@pytest.mark.parametrize("flatness", [1.0, 1e-3])
@pytest.mark.parametrize("distance", [0.0, 0.1])
def test_all_strips_within_a_distance_and_no_others(monkeypatch, flatness, distance, at_a_time):
    monkeypatch.setattr(strip_index, "_AT_A_TIME", at_a_time)
    strips = some_strips(40, flatness)
    triangles = [shapely.Polygon([*strip.left[:, :2], strip.right[1, :2]]) for strip in strips]
    points = np.random.default_rng(6).uniform(-1.0, 11.0, (4000, 2)) * [1.0, flatness]
    apart = shapely.distance(shapely.points(points)[:, None], np.array(triangles))
    expected = {(int(p), int(k)) for p, k in np.argwhere(apart <= distance)}
    cells = Cells(strips)
    if distance:
        hits = cells.within(points, distance)
        pairs = zip(hits.place.tolist(), hits.strip.tolist(), strict=True)
    else:
        pairs = zip(*(side.tolist() for side in cells.covering(points)), strict=True)
    assert set(pairs) == expected
    assert len(expected) > 100


@pytest.mark.parametrize("x", [100.0, 10.4])
def test_a_point_beside_all_strips_has_the_nearest_one(x):
    strips = some_strips(5, 1.0)
    triangles = [shapely.Polygon([*strip.left[:, :2], strip.right[1, :2]]) for strip in strips]
    point = np.array([[x, 5.0]])
    nearest = int(np.argmin(shapely.distance(shapely.Point(point[0]), np.array(triangles))))
    assert Cells(strips).at(point).strip.tolist() == [nearest]
