"""Form of plots: extents, the rectangle that each holds, straight sides, and nearness of sizes."""

import numpy as np
import pytest
from shapely import affinity, get_coordinates
from shapely.geometry import Polygon

from envgen_usd.landuse.network.training.plot_form import plot_form, size_score
from envgen_usd.models.landuse import LanduseClass, Plot


def plot(corners, turn=0.0):
    """A plot whose first side is its street side, turned by degrees."""
    ring = get_coordinates(affinity.rotate(Polygon(corners), turn, (0, 0)))[:-1]
    return Plot("plot_1", ring, LanduseClass.LAWN, ring[:2])


@pytest.mark.parametrize("turn", [0.0, 33.0, 180.0])
def test_rectangle(turn):
    frontage, depth, holds, straight = plot_form(
        [plot([(0, 0), (20, 0), (20, 30), (0, 30)], turn)], (19.0, 29.0)
    )[0]
    assert (frontage, depth) == pytest.approx((20.0, 30.0))
    assert (holds, straight) == (1.0, pytest.approx(1.0))


@pytest.mark.parametrize(("asked", "held"), [((21.5, 10.0), 0.0), ((10.0, 31.5), 0.0)])
def test_too_large(asked, held):
    assert plot_form([plot([(0, 0), (20, 0), (20, 30), (0, 30)])], asked)[0, 2] == held


@pytest.mark.parametrize(("asked", "held"), [((9, 29), 1.0), ((19, 9), 1.0), ((19, 29), 0.0)])
def test_bent(asked, held):
    # The bounds of an L hold a rectangle that the L does not.
    shape = plot([(0, 0), (20, 0), (20, 10), (10, 10), (10, 30), (0, 30)], 71.0)
    assert plot_form([shape], asked)[0, 2:].tolist() == [held, pytest.approx(1.0)]


def test_askew():
    # A triangle: the front of 20 m and the side of 20 m are straight, the third side is not.
    found = plot_form([plot([(0, 0), (20, 0), (20, 20)])], (5.0, 5.0))[0]
    assert found[3] == pytest.approx(2.0 / (2.0 + np.sqrt(2.0)))
    assert plot_form([], (5.0, 5.0)).shape == (0, 4)


def test_sizes():
    sizes = np.array([[20.0, 30.0], [20.0, 30.0], [10.0, 30.0]])
    assert size_score(sizes, sizes[::-1] * 1.15) == 1.0
    assert size_score(sizes, sizes * 1.3) == 0.0
    # A plot pairs off with a single other one.
    assert size_score(sizes, sizes[:1]) == pytest.approx(2.0 / 4.0)
    assert size_score(sizes, np.empty((0, 2))) == 0.0
