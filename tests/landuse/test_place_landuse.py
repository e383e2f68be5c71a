"""Ground truth of places: plots around houses within blocks, whole plots, what is given."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.area_statistics import box_statistics
from envgen_usd.landuse.osm_landuse import VERGE, OsmMap
from envgen_usd.landuse.place_landuse import PlaceMap
from envgen_usd.landuse.plot_territories import MARGIN, TERRITORY, separate, territories
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.place import Houses, Streets

GRASS, LAWN, RUBBLE, ROAD = (
    LanduseClass.GRASS,
    LanduseClass.LAWN,
    LanduseClass.RUBBLE,
    LanduseClass.ROAD,
)


def houses_of(boxes, landuse=""):
    words, nothing = np.full(len(boxes), "", np.str_), np.full(len(boxes), np.nan)
    kinds = np.full(len(boxes), landuse, "U20")
    shapes = np.array([shapely.box(*box) for box in boxes], object)
    return Houses(shapes, nothing, nothing, words, kinds, words, words, words)


def streets_of(*lines):
    count = len(lines)
    shapes = np.array([shapely.LineString(line) for line in lines], object)
    unknown = np.full(count, np.nan)
    return Streets(shapes, np.full(count, 6.0), np.ones(count, bool), unknown, unknown)


def square(houses, shapes=(), kinds=(), side=200, corner=(0, 0)):
    streets = streets_of([(-200, 10), (400, 10)])
    return PlaceMap(OsmMap("", shapes, kinds), streets, houses, 2.0).cells(corner, (side, side))


def test_a_cell_belongs_to_the_nearest_house_of_its_block():
    """Against a search over all cells of houses, with a road across and houses near it."""
    rng = np.random.default_rng(3)
    classes = np.full((90, 120), GRASS, np.uint8)
    classes[40:44], classes[44:, 60:63] = ROAD, LanduseClass.RAIL
    houses = np.zeros(classes.shape, np.int64)
    for number, (row, column) in enumerate(rng.integers((2, 2), (80, 110), (9, 2)), 1):
        houses[row : row + 6, column : column + 5] = number
    found = territories(houses, classes, np.full(10, 15.0))
    blocks = np.zeros(classes.shape)
    blocks[:40], blocks[44:, :60], blocks[44:, 63:] = 1, 2, 3
    row, column = np.nonzero((houses > 0) & (blocks > 0))
    for y, x in rng.integers((0, 0), classes.shape, (400, 2)).tolist():
        same = blocks[row, column] == blocks[y, x]
        away = np.hypot(row - y, column - x) + np.where(same, 0.0, 1e6)
        near = set(houses[row, column][away < away.min() + 1e-9].tolist())
        reached = blocks[y, x] > 0 and away.min() * CELL_SIZE <= 15.0
        assert found[y, x] in (near if reached else {0})


def test_houses_wall_to_wall_stay_apart():
    houses = np.zeros((20, 30), np.int64)
    houses[5:15, 5:12], houses[5:15, 12:20] = 1, 2
    inside = separate(houses)
    assert not inside[:, 11:12].any() or not inside[:, 12:13].any()
    assert inside[6:14, 6:10].all()
    assert inside[6:14, 14:19].all()


def test_a_lone_house_gets_the_land_within_its_reach():
    land = square(houses_of([(60, 70, 70, 80)]))
    area = np.count_nonzero(land.plots) * CELL_SIZE**2
    assert area == pytest.approx(shapely.box(60, 70, 70, 80).buffer(TERRITORY).area, rel=0.05)
    assert np.array_equal(land.classes == LAWN, land.plots > 0)
    assert np.count_nonzero(land.built) * CELL_SIZE**2 == pytest.approx(100, rel=0.15)


def test_a_hall_has_a_larger_yard_of_rubble():
    land = square(houses_of([(60, 80, 90, 100)], "industrial"))
    assert np.count_nonzero(land.classes == RUBBLE) > 2 * np.count_nonzero(
        square(houses_of([(60, 80, 90, 100)])).classes == LAWN
    )


def test_plots_end_at_streets_and_water():
    river = shapely.box(-200, 60, 400, 64)
    land = square(houses_of([(60, 40, 70, 50)]), [river], [LanduseClass.WATER])
    row, _ = np.nonzero(land.plots)
    north = (row.max() + 1) * CELL_SIZE
    south = row.min() * CELL_SIZE
    assert north == pytest.approx(60, abs=1)
    assert south == pytest.approx(10 + 3 + 2 + VERGE, abs=1)
    assert set(np.unique(land.classes[:, 80])) >= {ROAD, LanduseClass.WATER, LAWN, GRASS}


def test_streets_are_as_wide_as_they_are_with_sidewalks():
    land = square(houses_of([]), side=100)
    assert np.count_nonzero(land.classes[:, 50] == ROAD) * CELL_SIZE == pytest.approx(10, abs=1)


def test_a_car_park_is_a_whole_plot_and_forest_is_none():
    shapes = [shapely.box(20, 40, 50, 60), shapely.box(100, 40, 140, 90)]
    land = square(houses_of([]), shapes, [LanduseClass.PARKING, LanduseClass.WOOD])
    assert len(np.unique(land.plots)) == 2
    assert np.all(land.classes[land.plots > 0] == LanduseClass.PARKING)
    assert np.count_nonzero(land.plots) * CELL_SIZE**2 == pytest.approx(600, rel=0.05)


def test_a_box_is_the_same_part_of_a_larger_one():
    boxes = [(30 + 22 * n, 24 + 3 * (n % 2), 40 + 22 * n, 36) for n in range(6)]
    small = square(houses_of(boxes), side=100, corner=(40, 20))
    large = square(houses_of(boxes), side=240)
    cut = np.s_[20:120, 40:140]
    assert np.array_equal(small.classes, large.classes[cut])
    assert np.array_equal(small.built, large.built[cut])
    pairs = np.unique(np.stack([small.plots, large.plots[cut]]).reshape(2, -1), axis=1)
    assert len(np.unique(pairs[0])) == len(np.unique(pairs[1])) == pairs.shape[1]


def test_the_margin_holds_the_largest_yard():
    assert MARGIN * CELL_SIZE > 50.0 + 10.0


def test_statistics_count_what_stands_in_a_box():
    houses = houses_of([(20, 30, 30, 40), (50, 30, 70, 40), (500, 0, 600, 40)])
    land = square(houses, side=128)
    built, footprint, height, industrial = box_statistics(
        land.classes, houses, (0, 0, 128 * CELL_SIZE, 128 * CELL_SIZE), 3.0
    )
    road = np.count_nonzero(land.classes == ROAD)
    assert built == pytest.approx(300 / ((128**2 - road) * CELL_SIZE**2))
    assert footprint == pytest.approx(150)
    assert np.isnan(height)
    assert industrial == 0
