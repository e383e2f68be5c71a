"""Figures of buildings, measured on places whose figures are known."""

import numpy as np
import pytest
import shapely
import shapely.affinity

from envgen_usd.models.place import Houses, Place, Streets
from envgen_usd.places.building_figures import (
    BEHIND,
    END_GAP,
    STOREY,
    TERRITORY,
    measure,
    street_edges,
)

WIDTH = 6.0
"""Width of all streets, metres."""


def streets(*lines):
    count = len(lines)
    nothing = np.full(count, np.nan)
    shapes = np.array([shapely.LineString(line) for line in lines], object)
    return Streets(shapes, np.full(count, WIDTH), np.zeros(count, bool), nothing, nothing)


def houses(*shapes, storeys=None, heights=None, kinds=None, landuse=None):
    count = len(shapes)
    words = np.full(count, "", np.str_)
    return Houses(
        np.array(shapes, object),
        np.full(count, np.nan) if heights is None else np.array(heights, float),
        np.full(count, np.nan) if storeys is None else np.array(storeys, float),
        words if kinds is None else np.array(kinds, np.str_),
        words if landuse is None else np.array(landuse, np.str_),
        words,
        words,
        words,
    )


def place(buildings, ways):
    empty = np.empty((0, 2))
    nothing = np.empty(0, object), np.empty(0, np.str_)
    return Place("test", buildings, ways, empty, empty, *nothing)


def box(x, y, width, depth):
    return shapely.box(x, y, x + width, y + depth)


ALONG = [(0.0, 0.0), (200.0, 0.0)]


def test_sizes_and_setback_are_those_of_the_drawing():
    figures = measure(place(houses(box(50, 8, 12, 9), storeys=[3]), streets(ALONG)))
    assert (figures.area[0], figures.width[0], figures.depth[0]) == pytest.approx((108, 12, 9))
    assert figures.setback[0] == pytest.approx(8 - WIDTH / 2)
    assert figures.height[0] == 3 * STOREY
    assert figures.plot_depth[0] == pytest.approx(8 - WIDTH / 2 + 9 + BEHIND)
    assert figures.frontage[0] == pytest.approx(12 + 2 * END_GAP)


@pytest.mark.parametrize("angle", [20, 90, 135, 250])
def test_a_turned_place_has_the_same_figures(angle):
    def turned(shape):
        return shapely.affinity.rotate(shape, angle, origin=(0, 0))

    buildings = [box(50, 8, 12, 9), box(66, 9, 10, 14), box(50, -20, 8, 10)]
    way = turned(shapely.LineString(ALONG))
    before = measure(place(houses(*buildings), streets(ALONG)))
    after = measure(place(houses(*map(turned, buildings)), streets(way.coords)))
    for name in ("area", "width", "depth", "setback", "frontage", "plot_depth"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=0.01)
    np.testing.assert_allclose(after.gaps, before.gaps, atol=0.01)


def test_an_l_has_the_area_of_width_times_depth():
    shape = shapely.union(box(50, 8, 12, 5), box(50, 8, 4, 12))
    figures = measure(place(houses(shape), streets(ALONG)))
    assert figures.width[0] * figures.depth[0] == pytest.approx(shape.area)
    assert figures.fill[0] == pytest.approx(shape.area / 144)


def test_a_known_height_goes_before_storeys():
    figures = measure(place(houses(box(50, 8, 12, 9), storeys=[3], heights=[11.5]), streets(ALONG)))
    assert figures.height[0] == 11.5


def test_gaps_lead_to_the_next_house_on_the_same_side():
    row = [box(20, 8, 10, 9), box(36, 8, 10, 9), box(46, 8, 10, 9)]
    opposite = [box(28, -20, 10, 9), box(140, -20, 10, 9)]
    figures = measure(place(houses(*row, *opposite), streets(ALONG)))
    np.testing.assert_allclose(sorted(figures.gaps), [0.0, 6.0])
    np.testing.assert_allclose(figures.frontage[:3], [10 + END_GAP + 3, 10 + 3, 10 + END_GAP])
    np.testing.assert_allclose(figures.side_gap[:3], [3.0, 0.0, 0.0])
    assert sorted(figures.groups.tolist()) == [1, 1, 3]


def test_neighbours_beyond_a_crossing_are_none():
    crossing = streets(ALONG, [(60.0, -100.0), (60.0, 100.0)])
    figures = measure(place(houses(box(30, 8, 10, 9), box(80, 8, 10, 9)), crossing))
    assert len(figures.gaps) == 0


def test_streets_are_cut_where_they_meet():
    edges, widths = street_edges(streets(ALONG, [(60.0, 0.0), (60.0, 100.0)]))
    assert sorted(shapely.length(edges).tolist()) == [60.0, 100.0, 140.0]
    assert set(widths.tolist()) == {WIDTH}


def test_a_house_behind_another_or_far_away_has_no_setback():
    buildings = houses(box(50, 8, 12, 9), box(50, 21, 12, 9), box(120, 60, 12, 9))
    figures = measure(place(buildings, streets(ALONG)))
    assert figures.at_street.tolist() == [True, False, False]
    # Half of the four metres to the house behind belong to the first plot.
    assert figures.plot_depth[0] == pytest.approx(8 - WIDTH / 2 + 9 + 2)


def test_a_plot_ends_at_the_street_behind_it():
    parallel = streets(ALONG, [(0.0, 40.0), (200.0, 40.0)])
    figures = measure(place(houses(box(50, 8, 12, 9)), parallel))
    assert figures.plot_depth[0] == pytest.approx(40 - WIDTH)


def test_sheds_are_left_out_but_other_landuse_stays_a_neighbour():
    buildings = houses(
        box(20, 8, 10, 9),
        box(36, 8, 5, 5),
        box(45, 8, 10, 9),
        box(65, 8, 10, 9),
        kinds=["house", "yes", "garage", "yes"],
        landuse=["residential", "residential", "residential", "industrial"],
    )
    everything = measure(place(buildings, streets(ALONG)))
    assert len(everything.area) == 2
    homes = measure(place(buildings, streets(ALONG)), "residential")
    assert len(homes.area) == 1
    np.testing.assert_allclose(homes.gaps, [35.0])


def test_coverage_is_the_share_of_the_land_nearer_to_a_house_than_to_others():
    """A lattice of squares: each inner house has a square of land."""
    lattice = [box(30 * i, 100 + 30 * j, 12, 12) for i in range(5) for j in range(5)]
    figures = measure(place(houses(*lattice), streets(ALONG)))
    middle = figures.coverage.reshape(5, 5)[1:-1, 1:-1]
    np.testing.assert_allclose(middle, 144 / 900, rtol=0.03)


def test_carriageways_belong_to_no_house():
    single = place(houses(box(50, 8, 12, 9)), streets(ALONG))
    land = shapely.buffer(box(50, 8, 12, 9), TERRITORY)
    land = shapely.difference(land, shapely.box(0, -WIDTH / 2, 200, WIDTH / 2))
    assert measure(single).coverage[0] == pytest.approx(108 / land.area)


def test_a_place_without_streets_has_sizes_alone():
    none = streets()
    figures = measure(place(houses(box(50, 8, 12, 9), box(80, 8, 12, 9)), none))
    np.testing.assert_allclose(figures.area, 108)
    assert not figures.at_street.any()
    assert len(figures.gaps) == len(figures.groups) == 0


def test_halves_share_no_building():
    row = houses(*(box(20.0 * n, 8, 12, 9) for n in range(9)))
    west, east = place(row, streets([(0.0, 0.0), (172.0, 0.0)])).halves()
    assert (len(west.houses), len(east.houses)) == (4, 5)
    for half, low, high in ((west, 0.0, 86.0), (east, 86.0, 172.0)):
        bounds = shapely.total_bounds(half.streets.lines)
        assert (bounds[0], bounds[2]) == (low, high)
