"""Form of plots: extents, the rectangle that each holds, straight sides, and nearness of sizes."""

import numpy as np
import pytest
from shapely import affinity, get_coordinates
from shapely.geometry import Polygon

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.network.training.plot_form import asked_sizes, plot_form, size_score
from envgen_usd.landuse.plot_rectangles import holds_rectangle, site_rectangles
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.models.landuse import LanduseClass, Plot

ALONG = np.array([3.0, 0.0])


def plot(corners, turn=0.0):
    """A plot whose first side is its street side, turned by degrees."""
    ring = get_coordinates(affinity.rotate(Polygon(corners), turn, (0, 0)))[:-1]
    return Plot("plot_1", ring, LanduseClass.LAWN, ring[:2])


def sites(fronts, normals, depths):
    """Sites at a street."""
    count = len(depths)
    zeros = np.zeros(count)
    return Sites(
        np.array(fronts, float).reshape(-1, 2, 2),
        np.array(normals, float).reshape(-1, 2, 2),
        np.array(depths, float),
        zeros,
        zeros,
        zeros.astype(int),
        zeros.astype(bool),
        zeros.astype(int),
    )


def held(corners, size, turn=0.0):
    """Whether a plot holds a rectangle; what a cell may lack is added."""
    asked = np.array([size], float) + CELL_SIZE
    return bool(plot_form([plot(corners, turn)], asked)[0, 2])


@pytest.mark.parametrize("turn", [0.0, 33.0, 180.0])
def test_rectangle(turn):
    frontage, depth, holds, straight = plot_form(
        [plot([(0, 0), (20, 0), (20, 30), (0, 30)], turn)], np.array([[19.0, 29.0]])
    )[0]
    assert (frontage, depth) == pytest.approx((20.0, 30.0))
    assert (holds, straight) == (1.0, pytest.approx(1.0))


@pytest.mark.parametrize("size", [(21.5, 10.0), (10.0, 31.5)])
def test_too_large(size):
    assert not held([(0, 0), (20, 0), (20, 30), (0, 30)], size)


@pytest.mark.parametrize(("size", "holds"), [((9, 29), True), ((19, 9), True), ((19, 29), False)])
def test_bent(size, holds):
    # The bounds of an L hold a rectangle that the L does not.
    assert held([(0, 0), (20, 0), (20, 10), (10, 10), (10, 30), (0, 30)], size, 71.0) == holds


def test_a_cell_may_lack():
    corners = [(0, 0), (20, 0), (20, 30), (0, 30)]
    lacking = CELL_SIZE * np.array([[0.9, 0.9], [2.0, 0.0], [0.0, 2.0]])
    found = plot_form([plot(corners)] * 3, np.array([20.0, 30.0]) + lacking)
    assert found[:, 2].tolist() == [1.0, 0.0, 0.0]


def test_askew():
    # A triangle: the front of 20 m and the side of 20 m are straight, the third side is not.
    found = plot_form([plot([(0, 0), (20, 0), (20, 20)])], np.array([[5.0, 5.0]]))[0]
    assert found[3] == pytest.approx(2.0 / (2.0 + np.sqrt(2.0)))
    assert plot_form([], np.empty((0, 2))).shape == (0, 4)


def test_rectangles_of_sites():
    half = np.radians(10.0)
    inwards = [[np.sin(half), np.cos(half)], [-np.sin(half), np.cos(half)]]
    outwards = [[-np.sin(half), np.cos(half)], [np.sin(half), np.cos(half)]]
    front = [[0.0, 0.0], [10.0, 0.0]]
    found = site_rectangles(
        sites([front] * 3, [[[0, 1], [0, 1]], inwards, outwards], [20.0, 20.0, 20.0])
    )
    deep = 20.0 * np.cos(half)
    assert found[0] == pytest.approx((10.0, 20.0))
    # Inside of a bend the back is narrower; outside of it, the front limits the rectangle.
    assert found[1] == pytest.approx((10.0 - 2.0 * 20.0 * np.sin(half), deep))
    assert found[2] == pytest.approx((10.0, deep))
    for corners, size in zip(
        sites([front] * 3, [[[0, 1]] * 2, inwards, outwards], [20] * 3).polygons(),
        found,
        strict=True,
    ):
        assert holds_rectangle(corners, ALONG, tuple(size - 0.5))
        assert not holds_rectangle(corners, ALONG, (size[0] + 1.0, size[1] - 0.5))


def test_each_plot_is_asked_for_its_own_size():
    plots = [plot([(x, 0), (x + 10, 0), (x + 10, 20), (x, 20)]) for x in (0.0, 10.0, 20.0)]
    straight = [[0, 1], [0, 1]]
    laid = sites([[[20, 0], [30, 0]], [[0, 0], [10, 0]]], [straight, straight], [20.0, 18.0])
    asked = asked_sizes(plots, laid, (4.0, 7.0))
    assert asked.tolist() == [[10.0, 18.0], [4.0, 7.0], [10.0, 20.0]]


def test_sizes():
    sizes = np.array([[20.0, 30.0], [20.0, 30.0], [10.0, 30.0]])
    assert size_score(sizes, sizes[::-1] * 1.15) == 1.0
    assert size_score(sizes, sizes * 1.3) == 0.0
    # A plot pairs off with a single other one.
    assert size_score(sizes, sizes[:1]) == pytest.approx(2.0 / 4.0)
    assert size_score(sizes, np.empty((0, 2))) == 0.0
