"""Plots around the houses of a map, held against closed forms on drawn land."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.landuse.house_plots import REACH, PlotHouses, PlotLand, house_plots
from envgen_usd.landuse.plot_territories import MARGIN
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.models.landuse import LanduseClass

CHUNK = Chunk(0, 0)
SIDE = LANDUSE_CELLS + 2 * MARGIN


def land(*shapes, through=(), own=()):
    """Land of a chunk with shapes of classes on it, and with paths."""
    drawn = cells_of_shapes(CHUNK, shapes, MARGIN).astype(np.uint8)
    masks = [
        cells_of_shapes(CHUNK, [(shape, 1) for shape in paths], MARGIN) > 0
        for paths in (through, own)
    ]
    return PlotLand(CHUNK, MARGIN, drawn, *masks)


def plots_of(footprints, ground, lived_in=None):
    wanted = np.ones(len(footprints), bool) if lived_in is None else np.array(lived_in)
    houses = PlotHouses(np.array([*footprints, None], object)[:-1], wanted)
    return house_plots(houses, ground, LanduseClass.LAWN)


def area(plots, number):
    return np.count_nonzero(plots == number) * CELL_SIZE**2


def centres(plots, number):
    row, column = np.nonzero(plots == number)
    return (np.column_stack([column, row]) + 0.5 - MARGIN) * CELL_SIZE


def test_a_lone_house_in_a_square_block_has_the_block_up_to_a_verge():
    block = shapely.box(80.0, 80.0, 120.0, 120.0)
    street = block.buffer(8.0, join_style="mitre").difference(block)
    plots = plots_of([shapely.box(95.0, 95.0, 105.0, 105.0)], land((street, LanduseClass.ROAD)))
    # One cell beside the road is no part of it.
    assert area(plots, 1) == pytest.approx((40.0 - 2.0 * CELL_SIZE) ** 2, rel=0.05)
    assert block.buffer(-0.5 * CELL_SIZE).covers(shapely.MultiPoint(centres(plots, 1)))


@pytest.mark.parametrize("turn", [0.0, 30.0, 77.0])
def test_a_lone_house_in_the_open_has_a_rectangle_along_its_walls(turn):
    house = shapely.affinity.rotate(shapely.box(90.0, 94.0, 110.0, 106.0), turn)
    plots = plots_of([house], land())
    wanted = shapely.affinity.rotate(
        shapely.box(90.0 - REACH, 94.0 - REACH, 110.0 + REACH, 106.0 + REACH), turn, (100.0, 100.0)
    )
    assert area(plots, 1) == pytest.approx(wanted.area, rel=0.02)
    assert wanted.buffer(1e-6).covers(shapely.MultiPoint(centres(plots, 1)))


def test_two_houses_share_the_land_between_them_in_its_middle():
    houses = [shapely.box(80.0, 90.0, 90.0, 100.0), shapely.box(104.0, 90.0, 116.0, 100.0)]
    plots = plots_of(houses, land())
    beside = [place for place in (centres(plots, 1), centres(plots, 2)) if len(place)]
    level = [place[(place[:, 1] > 90.0) & (place[:, 1] < 100.0)] for place in beside]
    assert level[0][:, 0].max() == pytest.approx(97.0, abs=CELL_SIZE)
    assert level[1][:, 0].min() == pytest.approx(97.0, abs=CELL_SIZE)


def test_a_church_has_no_plot_and_keeps_its_land():
    houses = [shapely.box(80.0, 90.0, 90.0, 100.0), shapely.box(104.0, 90.0, 116.0, 100.0)]
    alone = plots_of(houses[:1], land())
    beside = plots_of(houses, land(), [True, False])
    assert not (beside == 2).any()
    assert centres(alone, 1)[:, 0].max() > 107.0
    level = centres(beside, 1)
    assert level[(level[:, 1] > 92.0) & (level[:, 1] < 98.0), 0].max() < 97.5


@pytest.mark.parametrize(
    "kind",
    [
        LanduseClass.WATER,
        LanduseClass.RAIL,
        LanduseClass.FIELD,
        LanduseClass.SQUARE,
        LanduseClass.PARKING,
        LanduseClass.PARK,
        LanduseClass.RUBBLE,
        LanduseClass.WOOD,
    ],
)
def test_other_land_of_the_map_is_no_part_of_a_plot(kind):
    other = shapely.box(104.0, 60.0, 140.0, 140.0)
    plots = plots_of([shapely.box(90.0, 95.0, 100.0, 105.0)], land((other, kind)))
    assert area(plots, 1) > 400.0
    assert not shapely.intersects_xy(other, *centres(plots, 1).T).any()


def test_a_path_that_leads_through_ends_a_plot_and_a_driveway_does_not():
    house, path = shapely.box(90.0, 95.0, 100.0, 105.0), shapely.box(104.0, 40.0, 106.0, 160.0)
    beyond = shapely.box(106.5, 96.0, 115.0, 104.0)
    cut = plots_of([house], land(through=[path]))
    assert not shapely.intersects_xy(path.union(beyond), *centres(cut, 1).T).any()
    whole = plots_of([house], land((path, LanduseClass.ACCESS), own=[path]))
    for part in (path.intersection(shapely.box(0, 90, 200, 110)), beyond):
        inside = shapely.intersects_xy(part, *centres(whole, 1).T)
        assert inside.sum() * CELL_SIZE**2 == pytest.approx(part.area, rel=0.4)
