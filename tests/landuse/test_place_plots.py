"""Plots of generated places: straight, right-angled to their streets, with a way to each."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.road_layouts import draw_layout
from envgen_usd.landuse.place_fitting import fit_places
from envgen_usd.landuse.place_landuse import land_with_plots
from envgen_usd.landuse.place_plots import straight_plots, with_straight_plots
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.landuse.shape_cells import cells_of_box
from envgen_usd.models.landuse import LanduseClass, LanduseMap

CHUNKS = [Chunk(x, y) for x in range(-1, 3) for y in range(-1, 3)]
CORNER = (-LANDUSE_CELLS, -LANDUSE_CELLS)
SIZE = (4 * LANDUSE_CELLS, 4 * LANDUSE_CELLS)
RESIDENTIAL = read_profile("1", "residential")
PROFILE = replace(RESIDENTIAL, plots=replace(RESIDENTIAL.plots, frontage=(18.0, 26.0)))


def town(kind, behind=()):
    """Houses of 10 x 8 m every 22 m along both sides of a random road, and some behind these."""
    surface = draw_layout(kind, np.random.default_rng(4))
    houses = []
    for side in find_roadsides(surface, PROFILE.plots, 0):
        middles = np.arange(15.0, side.length - 15.0, 22.0)
        places = [(along, 9.0) for along in middles]
        places += [(middles[n], 40.0) for n in behind if n < len(middles)]
        for along, away in places:
            point, normal = side.at(np.array(along))
            across = np.array([normal[1], -normal[0]])
            middle = point + away * normal
            corners = [(-5, -4), (5, -4), (5, 4), (-5, 4)]
            houses.append(shapely.Polygon([middle + u * across + v * normal for u, v in corners]))
    road = np.block(
        [
            [Outline.of(surface).encloses_grid(*Chunk(x, y).cell_centres()) for x in range(-1, 3)]
            for y in range(-1, 3)
        ]
    )
    base = np.where(road, LanduseClass.ROAD, LanduseClass.UNKNOWN).astype(np.uint8)
    cells = cells_of_box(CORNER, SIZE, zip(houses, range(1, len(houses) + 1), strict=True))
    return surface, houses, land_with_plots(base, cells, np.zeros(len(houses), bool))


def laid(surface, land):
    new = with_straight_plots(land, CORNER, surface, PROFILE, 0)
    maps = {}
    for chunk in CHUNKS:
        row, column = (chunk.y + 1) * LANDUSE_CELLS, (chunk.x + 1) * LANDUSE_CELLS
        cut = np.s_[row : row + LANDUSE_CELLS, column : column + LANDUSE_CELLS]
        maps[chunk] = LanduseMap(chunk, new.classes[cut].copy(), new.plots[cut].copy())
    return new, find_plots(maps, surface)


@pytest.mark.parametrize("kind", ["straight", "winding"])
def test_plots_are_straight_and_stand_square_to_their_street(kind):
    surface, houses, land = town(kind)
    _, plots = laid(surface, land)
    assert len(plots) >= 0.95 * len(houses)
    shapes = [shapely.Polygon(plot.polygon) for plot in plots]
    tree = shapely.STRtree(shapes)
    held = [np.any(shapely.covers(shapes, house.buffer(-CELL_SIZE))) for house in houses]
    assert np.mean(held) >= 0.95
    boxes = shapely.area(shapely.oriented_envelope(np.array(shapes, object)))
    assert np.median(shapely.area(shapes) / boxes) > (0.95 if kind == "straight" else 0.88)
    first, second = tree.query(shapes, "overlaps")
    both = shapely.intersection(np.take(shapes, first), np.take(shapes, second))
    assert np.all(shapely.area(both) < 0.5)
    for plot in plots:
        at_street = np.linalg.norm(plot.frontage[1] - plot.frontage[0])
        assert at_street > 10.0


def test_a_plot_behind_others_has_a_way_to_the_street_between_them():
    surface, houses, land = town("straight", behind=(2, 5))
    new, plots = laid(surface, land)
    assert len(plots) >= 0.95 * len(houses)
    paved = ndimage.label(np.isin(new.classes, (LanduseClass.ACCESS, LanduseClass.ROAD)))[0]
    road = np.unique(paved[new.classes == LanduseClass.ROAD])
    for number in np.unique(new.plots[new.plots > 0]):
        ways = paved[(new.plots == number) & (new.classes == LanduseClass.ACCESS)]
        assert np.isin(ways, road).any(), number


def test_land_without_a_street_has_no_plots():
    surface, _, land = town("straight")
    bare = land_with_plots(
        np.where(land.classes == LanduseClass.ROAD, land.classes, LanduseClass.PARK),
        np.zeros(SIZE, np.int64),
        np.zeros(0, bool),
    )
    new, _ = laid(surface, bare)
    assert not np.isin(new.classes, (LanduseClass.LAWN, LanduseClass.ACCESS)).any()
    assert np.array_equal(new.classes == LanduseClass.PARK, bare.classes == LanduseClass.PARK)


@pytest.mark.parametrize("kind", ["bend", "cross", "tee"])
def test_sites_that_roads_and_neighbours_cut_are_cut_straight(kind):
    """What is laid out is what the plot covers, also beside roads that meet at an angle."""
    surface, houses, land = town(kind)
    fitted = straight_plots(land, CORNER, surface, PROFILE, 0)
    asked = shapely.area(shapely.polygons(fitted.sites.polygons()))
    assert len(asked) >= 0.85 * len(houses)
    assert np.all(shapely.area(fitted.shapes) >= 0.97 * asked)
    corners = shapely.get_num_coordinates(shapely.simplify(fitted.shapes, 0.3)) - 1
    assert np.mean(corners == 4) >= 0.95


def test_plots_are_as_wide_as_their_environment_asks():
    """Houses every 22 m, where plots are 7 to 11 m wide, are taken for several that melted."""
    surface, houses, land = town("straight")
    fitted = straight_plots(land, CORNER, surface, RESIDENTIAL, 0)
    widths = np.linalg.norm(fitted.sites.fronts[:, 1] - fitted.sites.fronts[:, 0], axis=1)
    assert len(widths) >= 1.9 * len(houses)
    assert np.all((widths > 6.9) & (widths < 11.5))


def test_plots_whose_sides_cross_inside_of_a_bend_end_before_that():
    surface = draw_layout("bend", np.random.default_rng(4))
    side = find_roadsides(surface, PROFILE.plots, 0)[0]
    rng, one = np.random.default_rng(0), np.zeros(1, np.int64)
    kept = 0
    for start in rng.uniform(5.0, side.length - 45.0, 60):
        fronts, normals = side.fronts(np.array([start]), np.array([start + rng.uniform(8, 40)]))
        along = np.diff(fronts, axis=1) / np.linalg.norm(np.diff(fronts, axis=1))
        inwards = normals + rng.uniform(0.3, 1.5) * np.concatenate([along, -along], axis=1)
        depth, verge = rng.uniform(20.0, 60.0, 1), np.array([side.verge])
        sites = Sites(fronts, inwards, depth, verge, one + 0.5, one, one == 0, one)
        shapes = fit_places(sites, surface, PROFILE.plots).shapes
        assert shapely.is_valid(shapes).all()
        whole = shapely.convex_hull(shapely.polygons(sites.polygons()))
        assert np.all(shapely.area(shapely.difference(shapes, whole)) < 0.1)
        kept += len(shapes)
    assert kept > 5
