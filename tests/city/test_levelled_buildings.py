"""Given buildings on the ground; the truth is the height at which each block was drawn."""

import numpy as np
import pytest

from envgen_usd.city.plots.levelled_buildings import set_down
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.polygon_arrays import Polygons

RINGS = np.array([[x, y, z] for z in (0, 6) for x, y in ((0, 0), (8, 0), (8, 8), (0, 8))], float)


def house(name, x, foot):
    place = np.array([x, 0, foot])
    shape = Polygons.of_rings([RINGS[3::-1] + place, RINGS[4:] + place])
    # A footprint without true heights does not count.
    flat = Polygons.of_rings([RINGS[:4] + place * [1, 1, 0]])
    return CityObject(name, "Building", geometry={"lod1Solid": shape, "lod0MultiSurface": flat})


def slope(points):
    """Ground that rises by 1 m in 10 m to the east."""
    return 100.0 + 0.1 * points[:, 0]


def feet(buildings):
    return [float(b.geometry["lod1Solid"].points[:, 2].min()) for b in buildings]


def never(_):
    return False


def test_a_common_difference_goes_and_the_relief_of_a_true_ground_stays():
    given = [house("a", 0, 130), house("b", 100, 141), house("c", 200, 148)]

    levelled = set_down(given, slope, never, each=False)

    assert feet(levelled.buildings) == [100, 111, 118]
    assert [issue.action for issue in levelled.issues] == ["lowered by 30.0 m"]


def test_on_a_ground_of_ours_each_house_is_set_down():
    given = [house("a", 0, 130), house("b", 100, 141), house("c", 200, 145), house("d", 300, 160)]

    levelled = set_down(given, slope, never, each=True)

    # Distances are 30, 31, 25 and 30 m; one floats by 1 m, one stands 5 m deep.
    assert feet(levelled.buildings) == [100, 110, 120, 130]
    assert [issue.where for issue in levelled.issues] == ["city", "Building[b]", "Building[c]"]


def test_houses_near_the_ground_stay_as_they_are():
    given = [house("a", 0, 100.4), house("b", 100, 109.7), house("c", 200, 117.5)]

    levelled = set_down(given, slope, never, each=True)

    assert feet(levelled.buildings) == [100.4, 109.7, 117.5]
    assert levelled.issues == ()
    assert all(one is other for one, other in zip(levelled.buildings, given, strict=True))


def test_a_house_over_the_road_floats():
    given = [house("a", 0, 100), house("b", 100, 116), house("c", 200, 120)]

    levelled = set_down(given, slope, lambda shape: shape.bounds[0] == 100, each=True)

    assert feet(levelled.buildings) == [100, 116, 120]


@pytest.mark.parametrize("foot", [70.0, 1e4])
def test_a_single_house_is_set_down_from_any_height(foot):
    (found,) = set_down([house("a", 0, foot)], slope, never, each=False).buildings

    assert feet([found]) == [100]
