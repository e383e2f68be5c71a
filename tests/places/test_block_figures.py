"""Figures of blocks, on squares whose areas and fronts are known."""

import numpy as np
import pytest
import shapely

from envgen_usd.models.place import Houses, Place, Streets
from envgen_usd.places.block_figures import measure_blocks

SIDE, WIDTH = 120.0, 10.0
"""A square of streets, metres."""


def place_of(*footprints: shapely.Polygon, kinds: tuple[str, ...] = ()) -> Place:
    """A square block with houses."""
    corners = [(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE), (0, 0)]
    lines = [shapely.LineString(corners[n : n + 2]) for n in range(4)]
    count, unknown = len(footprints), np.full(len(footprints), np.nan)
    words = np.full(count, "", np.str_)
    named = np.array(kinds, np.str_) if kinds else words
    houses = Houses(
        np.array(footprints, object), unknown, unknown, named, words, words, words, words
    )
    streets = Streets(
        np.array(lines, object), np.full(4, WIDTH), np.ones(4, bool), np.full(4, 2), np.full(4, 2)
    )
    nothing = np.empty((0, 2))
    return Place("x", houses, streets, nothing, nothing, np.empty(0, object), np.empty(0, np.str_))


def test_a_block_is_the_land_between_carriageways():
    found = measure_blocks(place_of(shapely.box(20, 20, 40, 30)))
    assert shapely.area(found.blocks) == pytest.approx([(SIDE - WIDTH) ** 2])
    assert found.built == pytest.approx([200.0 / (SIDE - WIDTH) ** 2])


def test_the_core_lies_behind_the_first_row():
    """Of a house of 10 m x 10 m, half reaches behind the first 25 m from the carriageway."""
    found = measure_blocks(place_of(shapely.box(55, 25, 65, 35)))
    core = (SIDE - WIDTH - 50.0) ** 2
    assert found.core_built == pytest.approx([50.0 / core])


def test_fronts_without_a_house_are_open():
    """A wall of houses along the inside of one street closes an eighth of all views."""
    free = measure_blocks(place_of(shapely.box(50, 50, 70, 70)))
    assert free.is_open.all()
    closed = measure_blocks(place_of(shapely.box(5, 8, 115, 18)))
    # Of 4 x 2 sides with 60 views each, that of this street has 55; the ends of two more see it.
    inside = closed.is_open.size - closed.is_open.sum()
    assert inside == pytest.approx(55 + 2 * 5, abs=2)


def test_sheds_close_no_front_but_cover_land():
    shed = place_of(shapely.box(5, 8, 115, 18), kinds=("shed",))
    assert measure_blocks(shed).is_open.all()
    assert measure_blocks(shed).built[0] > 0.08


def test_a_place_without_streets_has_neither_blocks_nor_fronts():
    place = place_of(shapely.box(5, 8, 115, 18))
    box = (200.0, 200.0, 300.0, 300.0)
    found = measure_blocks(place.within(box))
    assert not len(found.blocks)
    assert not len(found.is_open)
