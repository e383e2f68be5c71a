"""The largest rectangle against closed forms and against random rivals."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from envgen_usd.city.plots.largest_rectangle import largest_rectangle


def area(box):
    return (box[2] - box[0]) * (box[3] - box[1])


TURN = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)


@pytest.mark.parametrize(
    ("polygon", "expected"),
    [
        # A rectangle is its own largest rectangle.
        ([(0, 0), (7, 0), (7, 3), (0, 3)], 21.0),
        # A triangle holds at most half its area, a rhombus with its diagonals in the axes too.
        ([(0, 0), (4, 0), (0, 3)], 3.0),
        ([(0, 0), (10, 0), (3, 6)], 15.0),
        ([(0, -2), (3, 0), (0, 2), (-3, 0)], 6.0),
        # The unit circle holds a square of area 2.
        (np.column_stack([np.cos(TURN), np.sin(TURN)]), 2.0),
        # L, U and C.
        ([(0, 0), (4, 0), (4, 1), (2, 1), (2, 6), (0, 6)], 12.0),
        ([(0, 0), (5, 0), (5, 5), (4, 5), (4, 1), (1, 1), (1, 5), (0, 5)], 5.0),
        ([(0, 0), (5, 0), (5, 1), (1, 1), (1, 4), (5, 4), (5, 5), (0, 5)], 5.0),
    ],
)
def test_closed_forms(polygon, expected):
    found = largest_rectangle(np.array(polygon, dtype=float))
    assert area(found) == pytest.approx(expected, rel=1e-3)


def stars():
    return st.lists(
        st.tuples(st.floats(0.3, 1.0), st.floats(0.5, 1.5)), min_size=4, max_size=9
    ).map(_star)


def _star(steps):
    angle = np.cumsum([step for step, _ in steps])
    angle *= 2 * np.pi / angle[-1]
    radius = 10 * np.array([r for _, r in steps])
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


@settings(max_examples=40)
@given(polygon=stars(), seed=st.integers(0, 2**32 - 1))
def test_lies_inside_and_no_random_rectangle_is_larger(polygon, seed):
    shape = shapely.Polygon(polygon)
    box = largest_rectangle(polygon)
    assert shape.buffer(1e-6).covers(shapely.box(*box))
    x, y = np.sort(np.random.default_rng(seed).uniform(-15, 15, (2, 20_000, 2)), axis=2)
    inside = shapely.covers(shape, shapely.box(x[:, 0], y[:, 0], x[:, 1], y[:, 1]))
    rivals = (np.ptp(x, axis=1) * np.ptp(y, axis=1))[inside]
    # A polygon that folds back is searched on a raster, which may miss a little.
    assert area(box) >= 0.9 * rivals.max(initial=0.0)
