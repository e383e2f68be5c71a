"""Distances of towns, on places whose figures are known."""

import numpy as np
import pytest
import shapely

from envgen_usd.errors import EnvgenError
from envgen_usd.models.place import Houses, Place, Streets
from envgen_usd.recipe.place_realism import largest_gap, place_distances


def town(side, height, count=60):
    """Squares in a row, without streets."""
    x = np.arange(count) * 50.0
    words, nothing = np.full(count, "", np.str_), np.full(count, np.nan)
    squares = shapely.box(x, 0.0, x + side, side)
    houses = Houses(squares, np.full(count, height), nothing, *[words] * 5)
    none = np.empty(0)
    streets = Streets(np.empty(0, object), none, none.astype(bool), none, none)
    points = np.empty((0, 2))
    lines = np.empty(0, object), np.empty(0, np.str_)
    return Place("town", houses, streets, points, points, *lines)


def test_the_largest_gap_of_distributions():
    assert largest_gap(np.arange(10.0), np.arange(10.0)) == 0.0
    assert largest_gap(np.arange(10.0), np.arange(10.0) + 100.0) == 1.0
    assert largest_gap(np.arange(10.0), np.arange(5.0)) == pytest.approx(0.5)


def test_equal_sizes_and_other_heights_are_told_apart():
    found = {d.name: d for d in place_distances(town(12.0, 9.0), town(12.0, 15.0))}
    assert found["footprint, m²"].synthetic == 0.0
    assert found["height, m"].synthetic == 1.0
    assert found["height, m"].real == 0.0
    assert "setback, m" not in found  # no streets, no setbacks


def test_places_with_few_buildings_are_refused():
    with pytest.raises(EnvgenError, match="no figure with 10 samples"):
        place_distances(town(12.0, 9.0, 5), town(12.0, 9.0, 5))
