from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.network.data.known_fields import RAW, index_streets, raw_fields
from envgen_usd.landuse.network.data.road_layouts import draw_layout
from envgen_usd.landuse.network.data.street_conditions import (
    draw_streets,
    fit_streets,
    street_sites,
    unknown_streets,
)
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.landuse.site_fitting import fit_sites

RULES = read_profile("2", "residential").plots
GRID = np.linspace(0.0, 300.0, 3001)


@pytest.fixture(scope="module")
def surface():
    return draw_layout("cross", np.random.default_rng(4))


@pytest.fixture(scope="module")
def sides(surface):
    return find_roadsides(surface, RULES, 1)


@given(seed=st.integers(0, 2**32 - 1))
def test_plots_begin_at_whole_phases_within_the_environments_ranges(sides, seed):
    for street in draw_streets(sides, RULES, seed):
        stops = street.stops()
        assert np.allclose(street.phase(stops), np.arange(len(stops)), atol=2e-3)
        assert np.all(np.diff(street.phase(np.linspace(0, street.side.length, 500))) > 0)
        assert RULES.frontage[0] <= street.frontage <= RULES.frontage[1]
        assert np.all((RULES.depth[0] <= street.depths) & (street.depths <= RULES.depth[1]))


def test_a_plot_is_where_its_row_has_not_ended(sides):
    streets = draw_streets(sides, RULES, 5)
    sites = street_sites(streets)
    for number, street in enumerate(streets):
        stops = street.stops()
        middles = (stops[1:] + stops[:-1]) / 2
        assert np.count_nonzero(street.left(middles) > 0) == np.sum(sites.sides == number)


def test_fitting_plots_are_those_that_the_rules_would_use(surface, sides):
    streets = draw_streets(sides, RULES, 5)
    fitted = street_sites(fit_streets(streets, surface, RULES))
    expected = fit_sites(street_sites(streets), surface, RULES)
    assert 0 < len(fitted) < len(street_sites(streets))
    assert np.array_equal(fitted.fronts, expected.fronts)
    assert np.array_equal(fitted.depths, expected.depths)


def test_between_rows_less_than_nothing_is_left(sides):
    street = replace(draw_streets(sides, RULES, 5)[0], present=np.array([1, 1, 0, 0, 1], np.bool_))
    stops = np.interp(np.arange(6), street.phase(GRID), GRID)
    middles = (stops[1:] + stops[:-1]) / 2
    assert np.allclose(street.left(middles), [1.5, 0.5, -0.5, -1.0, 0.5], atol=1e-2)


def test_streets_that_are_not_told_of_have_the_middles_of_the_ranges(sides):
    street = unknown_streets(sides, RULES)[0]
    along = np.array([0.0, 10.0])
    assert street.frontage == sum(RULES.frontage) / 2
    assert np.allclose(street.phase(along), along / street.frontage)
    assert np.allclose(street.depth(along), sum(RULES.depth) / 2)


def test_fields_say_where_a_plot_is_seen_from_its_street(surface, sides):
    """Places in the middle of a plot's front lie half a plot along, at no offset."""
    streets = draw_streets(sides, RULES, 5)
    sites = street_sites(streets)
    index = index_streets(surface, streets, told=True, wood=(0.2, 5))
    for front, depth in zip(sites.fronts[::5], sites.depths[::5], strict=True):
        x, y = front.mean(axis=0)
        fields = dict(
            zip(RAW, raw_fields(index, np.array([x]), np.array([y]))[:, 0, 0], strict=True)
        )
        assert abs(fields["phase"] - 0.5) < 0.1
        assert abs(fields["offset"]) < 1.5
        assert fields["depth"] == pytest.approx(depth, abs=0.05)
        assert fields["left"] > 0
        assert fields["told"] == 1


def test_places_that_no_road_is_near_are_all_alike(surface, sides):
    index = index_streets(surface, draw_streets(sides, RULES, 5), told=True, wood=(0.0, 5))
    fields = raw_fields(index, np.array([5000.0, 5100.0]), np.array([5000.0]))
    open_land = [RAW.index(name) for name in ("along", "offset", "open", "rival_first", "wood")]
    assert np.array_equal(fields[open_land, 0, 0], fields[open_land, 0, 1])
