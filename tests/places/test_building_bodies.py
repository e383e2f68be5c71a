"""Parts of mapped buildings as bodies that share no space."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.places.places_extracts import Extract

from envgen_usd.models.place import BuildingParts, Houses, Place, Streets
from envgen_usd.places.building_bodies import with_bodies
from envgen_usd.places.osm_place import read_osm_place


def ring(west, south, east, north):
    corners = [(west, south), (east, south), (east, north), (west, north)]
    return [*corners, corners[0]]


def bodies_of(extract, tmp_path):
    place = with_bodies(read_osm_place(extract.write(tmp_path / "place.osm")))
    return place.houses, {issue.kind: issue.message for issue in place.issues}


@pytest.mark.parametrize(
    ("tags", "bottom", "top"),
    [
        ({"min_height": "4", "height": "12"}, 4.0, 12.0),
        ({"min_height": "4.5 m", "building__levels": "3"}, 4.5, 9.0),
        ({"building__min_level": "2", "building__levels": "5"}, 6.0, 15.0),
        ({"building__min_level": "2", "building__levels": "5", "height": "20"}, 8.0, 20.0),
        ({"min_height": "6"}, 6.0, 9.0),
        ({"height": "12"}, 0.0, 12.0),
        ({"height": "12", "min_height": "-3"}, 0.0, 12.0),
        ({"height": "12", "min_height": "1e9"}, 0.0, 12.0),
    ],
)
def test_a_part_reaches_from_its_underside_to_its_top(tmp_path, tags, bottom, top):
    extract = Extract()
    extract.way(*ring(0, 0, 20, 10), building="yes")
    extract.way(*ring(0, 0, 20, 10), building__part="yes", **tags)
    houses, _ = bodies_of(extract, tmp_path)
    assert len(houses) == 1
    assert (houses.bottoms[0], houses.heights[0]) == (bottom, top)


def test_parts_stand_instead_of_the_outline_where_they_cover_it(tmp_path):
    extract = Extract()
    extract.way(*ring(0, 0, 40, 10), building="church", building__levels="2", height="9")
    extract.way(*ring(0, 0, 10, 10), building__part="yes", height="30", roof__shape="pyramidal",
                roof__height="8")  # fmt: skip
    extract.way(*ring(60, 0, 70, 10), building="house")
    houses, issues = bodies_of(extract, tmp_path)
    order = np.argsort(shapely.area(houses.footprints))
    assert shapely.area(houses.footprints[order]) == pytest.approx([100, 100, 300], rel=0.01)
    (tower,) = np.flatnonzero(houses.heights == 30.0)
    assert (houses.roofs[tower], houses.roof_heights[tower]) == ("pyramidal", 8.0)
    assert str(houses.kinds[tower]) == "church"
    rest = int(order[-1])
    assert houses.groups[rest] == houses.groups[tower] >= 0
    assert (houses.groups == houses.groups[tower]).sum() == 2
    assert houses.heights[rest] == 9.0
    assert issues["osm.building_parts"].startswith("1 parts of buildings stand instead of 1 ")


def test_a_rest_of_unknown_height_is_as_high_as_the_lowest_part(tmp_path):
    extract = Extract()
    extract.way(*ring(0, 0, 40, 10), building="church")
    extract.way(*ring(0, 0, 10, 10), building__part="yes", height="30")
    extract.way(*ring(10, 0, 20, 10), building__part="yes", height="12")
    extract.way(*ring(60, 0, 70, 10), building="house")
    houses, _ = bodies_of(extract, tmp_path)
    assert sorted(houses.heights[houses.groups >= 0]) == [12.0, 12.0, 30.0]
    assert np.isnan(houses.heights[houses.groups < 0]).all()


def test_a_tower_over_a_hall_stands_on_its_roof_and_the_hall_stays(tmp_path):
    extract = Extract()
    extract.way(*ring(0, 0, 40, 30), building="yes", height="50")
    extract.way(*ring(0, 0, 40, 30), building__part="yes", height="8")
    extract.way(*ring(10, 10, 20, 20), building__part="yes", height="50")
    houses, _ = bodies_of(extract, tmp_path)
    assert sorted(zip(houses.bottoms, houses.heights, strict=True)) == [(0.0, 8.0), (8.0, 50.0)]


def test_a_part_without_an_outline_is_a_building_and_a_low_outline_stays_below(tmp_path):
    extract = Extract()
    extract.way(*ring(0, 0, 40, 30), building="yes", height="10")
    extract.way(*ring(0, 0, 40, 30), building__part="yes", min_height="10", height="30")
    extract.way(*ring(100, 0, 110, 10), building__part="garage", height="3")
    houses, _ = bodies_of(extract, tmp_path)
    found = sorted(zip(houses.groups < 0, houses.bottoms, houses.heights, strict=True))
    assert found == [(False, 0.0, 10.0), (False, 10.0, 30.0), (True, 0.0, 3.0)]


@given(
    st.lists(
        st.tuples(*[st.integers(0, 12)] * 2, *[st.integers(1, 12)] * 2, *[st.integers(0, 9)] * 2),
        min_size=2,
        max_size=6,
    )
)
@settings(max_examples=40, deadline=None)
def test_no_two_bodies_share_space(parts):
    """Whatever parts a map draws."""
    shapes = np.array([shapely.box(x, y, x + w, y + d) for x, y, w, d, _, _ in parts], object)
    bottoms = np.array([low for *_, low, _ in parts], float)
    tops = np.array([low + rise for *_, low, rise in parts], float)
    place = Place(
        "map", _houses(shapes[:0]), Streets(*[np.empty(0)] * 5), *[np.empty((0, 2))] * 2,
        *[np.empty(0, object)] * 2,
        parts=BuildingParts(_houses(shapes, tops, bottoms), np.full(len(parts), -1)),
    )  # fmt: skip
    bodies = with_bodies(place).houses
    for n in range(len(bodies)):
        for m in range(n):
            low = max(bodies.bottoms[n], bodies.bottoms[m])
            high = min(bodies.heights[n], bodies.heights[m])
            shared = shapely.area(shapely.intersection(*bodies.footprints[[n, m]]))
            assert high - low <= 0.0 or shared < 0.06
    # The highest point over each place stays.
    for x, y in ((0.5, 0.5), (6.5, 6.5), (11.5, 3.5)):
        over = shapely.contains_xy(shapes, x, y) & (tops - bottoms >= 0.5)
        if over.any():
            here = shapely.contains_xy(bodies.footprints, x, y)
            assert bodies.heights[here].max() == tops[over].max()


def _houses(shapes, tops=(), bottoms=()):
    words = np.full(len(shapes), "", np.str_)
    flat = np.full(len(shapes), "flat")
    nothing = np.full(len(shapes), np.nan)
    return Houses(
        shapes, np.array(tops), nothing, words, words, flat, words, words, np.array(bottoms)
    )
