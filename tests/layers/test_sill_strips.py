"""Strips of wall below windows, which carry the height of their sill."""

from collections import Counter

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.layers.sill_strips import PERIOD, sill_periods, with_sill_strips
from envgen_usd.models.polygon_arrays import Polygons

LENGTH, HEIGHT = 10.0, 7.0
WINDOWS = [(1.0, 1.2), (5.0, 1.2)]
"""Left edge and width of the columns, metres."""
SILLS = (0.9, 4.0)
TURN = np.radians(33.0)


def at(x, z, side=0.0):
    """A place on a wall that stands askew, seen from outside with x to the right."""
    along = np.array([np.cos(TURN), np.sin(TURN)])
    return np.round([*(7.0 + along * x + side * along[::-1]), z + 30.0], 3)


def rectangle(left, low, right, high):
    return [at(left, low), at(right, low), at(right, high), at(left, high)]


def wall(windows=None):
    windows = windows or [(x, z, x + w, z + 1.4) for x, w in WINDOWS for z in SILLS]
    rings = [rectangle(0, 0, LENGTH, HEIGHT), *(rectangle(*each)[::-1] for each in windows)]
    sizes = np.cumsum([0, *map(len, rings)])
    return Polygons(np.concatenate(rings), sizes, np.array([0, len(rings)]))


def cut(polygons, share=1.0):
    return with_sill_strips(polygons, share, np.random.default_rng(0))


def edges_of(polygons):
    triangles = triangulate(polygons)[0]
    corners = [tuple(map(tuple, polygons.points[row])) for row in triangles]
    return Counter((row[k], row[(k + 1) % 3]) for row in corners for k in range(3))


def area(polygons):
    a, b, c = np.moveaxis(polygons.points[triangulate(polygons)[0]], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def test_each_window_has_a_strip_down_to_what_is_below():
    """The window below, or 8 cm above the foot of the wall."""
    strips, sills = cut(wall())
    wanted = sorted(30.0 + z for _ in WINDOWS for z in SILLS)
    assert sorted(sills[~np.isnan(sills)]) == pytest.approx(wanted, abs=2e-3)
    heights = {4.0: (32.3, 34.0), 0.9: (30.08, 30.9)}
    for polygon in np.flatnonzero(~np.isnan(sills)).tolist():
        (ring,) = strips.rings(polygon)
        low, high = heights[round(sills[polygon] - 30.0, 3)]
        assert (ring[:, 2].min(), ring[:, 2].max()) == pytest.approx((low, high), abs=2e-3)
        assert np.ptp(ring[:, :2] @ [np.cos(TURN), np.sin(TURN)]) == pytest.approx(1.2, abs=3e-3)


def test_the_wall_keeps_its_area_its_side_and_its_edges():
    """Each inner edge has a triangle on both sides; those of openings and of the outline one."""
    before, (after, _) = wall(), cut(wall())
    assert area(after) == pytest.approx(area(before), rel=1e-6)
    normals = [np.cross(*np.diff(after.points[row], axis=0)) for row in triangulate(after)[0]]
    assert (np.array(normals) @ [np.sin(TURN), -np.cos(TURN), 0.0] > 0).all()
    edges = edges_of(after)
    assert set(edges.values()) == {1}
    before_edges = edges_of(before)
    open_before = {edge for edge in before_edges if (edge[1], edge[0]) not in before_edges}
    assert {edge for edge in edges if (edge[1], edge[0]) not in edges} == open_before


def test_a_strip_adds_triangles_only_below_the_lowest_window():
    before, (after, _) = wall(), cut(wall())
    more = 4 * len(WINDOWS)
    assert len(triangulate(after)[0]) == len(triangulate(before)[0]) + more


def test_a_share_of_the_windows():
    many = [(x, z, x + 0.8, z + 1.0) for x in np.arange(1, 9, 1.5) for z in (1.0, 3.0, 5.0)]
    counts = [
        np.isfinite(with_sill_strips(wall(many), 0.5, np.random.default_rng(k))[1]).sum()
        for k in range(30)
    ]
    assert 0.4 < np.mean(counts) / len(many) < 0.6
    plain, sills = cut(wall(), 0.0)
    assert len(plain) == 1
    assert np.isnan(sills).all()


@pytest.mark.parametrize(
    ("windows", "strips"),
    [
        ([(1.0, 4.0, 2.2, 5.4), (0.5, 0.1, 2.7, 2.3)], 0),  # a gate below is wider
        ([(1.0, 4.0, 2.2, 5.4), (1.0, 0.1, 2.2, 2.3)], 1),  # a door of its width
        ([(1.0, 4.0, 2.2, 5.4)], 1),  # none below
        ([(1.0, 0.3, 2.2, 1.4)], 0),  # no room below
        ([(1.0, 0.9, 2.2, 2.4), (2.0, 0.1, 3.0, 0.6)], 0),  # a cellar window beside the middle
    ],
)
def test_what_stands_below_a_window_decides(windows, strips):
    assert np.isfinite(cut(wall(windows))[1]).sum() == strips


def test_a_strip_ends_above_a_rising_foot_and_after_two_and_a_half_metres():
    """The foot of the wall rises from 0 to 2 m over its length; the ends follow it."""
    windows = [(x, 5.0, x + 1.0, 6.0) for x in (1.0, 4.0, 8.0)]
    rings = [[at(0, 0), at(LENGTH, 2.0), at(LENGTH, HEIGHT), at(0, HEIGHT)]]
    rings += [rectangle(*each)[::-1] for each in windows]
    sizes = np.cumsum([0, *map(len, rings)])
    high = Polygons(np.concatenate(rings), sizes, np.array([0, len(rings)]))
    strips, sills = cut(high)
    ends = [strips.rings(k)[0][:, 2].min() - 30.0 for k in np.flatnonzero(np.isfinite(sills))]
    assert sorted(ends) == pytest.approx([2.5, 2.5, 2.5], abs=2e-3)
    low = [(x, 3.0, x + 1.0, 4.0) for x in (1.0, 8.0)]
    rings = [rings[0], *(rectangle(*each)[::-1] for each in low)]
    sizes = np.cumsum([0, *map(len, rings)])
    strips, sills = cut(Polygons(np.concatenate(rings), sizes, np.array([0, len(rings)])))
    ends = [strips.rings(k)[0][:, 2].min() - 30.0 for k in np.flatnonzero(np.isfinite(sills))]
    assert min(ends) > 0.2 * 2.0, "above the foot at x = 2"
    assert max(ends) > 0.2 * 9.0, "above the foot at x = 9"
    assert area(strips) == pytest.approx(
        area(Polygons(np.concatenate(rings), sizes, np.array([0, len(rings)]))), rel=1e-6
    )


def test_other_shapes_stay():
    arch = [at(2, 1), at(2, 2), at(2.5, 2.5), at(3, 2), at(3, 1)]
    rings = [rectangle(0, 0, LENGTH, HEIGHT), arch]
    sizes = np.cumsum([0, *map(len, rings)])
    same, sills = cut(Polygons(np.concatenate(rings), sizes, np.array([0, 2])))
    assert len(same) == 1
    assert np.isnan(sills).all()


def test_periods_are_whole_and_tell_each_step_of_height():
    heights = np.arange(1, 190) * 0.1
    periods = sill_periods(heights)
    assert (periods % PERIOD == 0).all()
    assert periods.min() >= 2 * PERIOD
    assert len(np.unique(periods, axis=0)) == len(heights)
    assert (sill_periods(np.zeros(3)) == 0).all()


def test_strips_of_a_built_stage_hang_from_openings(stage_file):
    """Read back as `surface_wear.glsl` reads it: the height is that of an opening's lower edge."""
    stage = Usd.Stage.Open(str(stage_file))
    shells = [prim for prim in stage.Traverse() if prim.GetName() == "Shell"]
    found = 0
    for prim in shells:
        mesh = UsdGeom.Mesh(prim)
        index = np.asarray(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        points = np.asarray(mesh.GetPointsAttr().Get(), float)
        st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened()
        uv = np.asarray(st, float).reshape(-1, 3, 2)
        digits = np.floor(uv / PERIOD) - 2
        chosen = np.flatnonzero((digits >= 0).all(axis=(1, 2)))
        other = np.setdiff1d(np.arange(len(uv)), chosen)
        assert (digits[other].min(axis=2) < 0).all()
        for row in chosen.tolist():
            assert (digits[row] == digits[row, 0]).all()
            sill = 0.1 * (digits[row, 0] @ [1, 14] + 1)
            top = points[index[row]][:, 2].max()
            assert 0.0 <= sill - top + 1e-4 < 0.1 + 2e-4
            found += 1
    assert found >= 2 * 10
