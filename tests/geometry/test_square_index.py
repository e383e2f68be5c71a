import numpy as np
import pytest

from envgen_usd.geometry.square_index import SIDE, LineIndex, SquareIndex, are_near

EVERYWHERE = (-np.inf, -np.inf, np.inf, np.inf)


@pytest.fixture(scope="module")
def boxes() -> tuple[np.ndarray, np.ndarray]:
    """Boxes of all sizes, some of them of none, some on the borders of squares."""
    draw = np.random.default_rng(0)
    low = draw.uniform(-900.0, 700.0, (400, 2))
    low[::5] = np.round(low[::5] / SIDE) * SIDE
    size = draw.exponential(40.0, (400, 2))
    size[::7] = 0.0
    return low, low + size


@pytest.mark.parametrize("margin", [0.0, 13.0, 250.0])
def test_all_boxes_near_a_rectangle_are_there_and_few_others(boxes, margin):
    low, high = boxes
    index = SquareIndex.of(low, high)
    for corner in np.random.default_rng(1).uniform(-900.0, 700.0, (50, 2)):
        start = np.round(corner / SIDE) * SIDE
        bounds = (*start, *(start + np.array([200.0, 50.0])))
        near = (low <= np.array(bounds[2:]) + margin) & (high >= np.array(bounds[:2]) - margin)
        found = index.near(bounds, margin)
        assert np.array_equal(found, np.unique(found))
        assert set(np.flatnonzero(near.all(axis=1))) <= set(found)
        # What is farther away shares a square with the rectangle.
        apart = np.maximum(low[found] - bounds[2:], np.array(bounds[:2]) - high[found])
        assert apart.max(initial=0.0) <= margin + SIDE + 0.01


def test_everything_is_in_a_rectangle_without_end(boxes):
    assert np.array_equal(SquareIndex.of(*boxes).near(EVERYWHERE, 0.0), np.arange(400))


def test_an_empty_index_has_no_rows():
    none = np.empty((0, 2))
    assert len(SquareIndex.of(none, none).near(EVERYWHERE, 10.0)) == 0
    assert len(LineIndex.of([], np.empty(0)).near(EVERYWHERE, 10.0)) == 0


def test_lines_are_found_where_they_pass_and_not_all_over_their_bounding_box():
    diagonal = np.array([[0.0, 0.0, 5.0], [1000.0, 1000.0, 5.0]])
    lines = [
        diagonal,
        np.empty((0, 3)),
        np.array([[40.0, 910.0]]),
        diagonal + np.array([300, 0, 0]),
    ]
    index = LineIndex.of(lines, np.array([0.0, 9.0, 4.0, 30.0]))
    assert index.near((495.0, 495.0, 505.0, 505.0), 0.0).tolist() == [0]
    assert index.near((0.0, 850.0, 100.0, 1000.0), 0.0).tolist() == [2]
    assert index.near((650.0, 350.0, 750.0, 450.0), 0.0).tolist() == [3]
    assert index.near(EVERYWHERE, 0.0).tolist() == [0, 2, 3]


def test_the_reach_of_a_line_lies_beside_it():
    line = [np.array([[10.0, 10.0], [10.0, 600.0]])]
    beyond = (10.0 + 3 * SIDE, 0.0, 10.0 + 4 * SIDE, 600.0)
    assert len(LineIndex.of(line, np.array([0.0])).near(beyond, 0.0)) == 0
    assert len(LineIndex.of(line, np.array([3 * SIDE])).near(beyond, 0.0)) == 1


def test_points_near_a_rectangle():
    points = np.array([[0.0, 0.0], [-2.0, 0.0], [0.0, 3.1], [1.0, 1.0]])
    assert are_near(points, (0.0, 0.0, 1.0, 1.0), 2.0).tolist() == [True, True, False, True]
