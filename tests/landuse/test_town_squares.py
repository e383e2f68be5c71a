"""Squares take the place of plots side by side, and leave all others as they are."""

from dataclasses import replace
from pathlib import Path

import envgen_usd.asset_library
import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE, chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.blocks.town_squares import with_squares
from envgen_usd.landuse.landuse_rules import RuleProvider, fitted_sites
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.models.land_rules import SquareRules
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

STRAIGHT = Path(envgen_usd.asset_library.__path__[0]) / "roads" / "straight.xodr"
WIDTH = (28.0, 36.0)
SURFACE = build_surface(read_network(STRAIGHT))
PROFILE = read_profile("1", "city_centre")
SITES = fitted_sites(SURFACE, find_roadsides(SURFACE, PROFILE.plots, 0), PROFILE, 0)


def test_squares_are_as_wide_as_wanted_and_take_whole_plots() -> None:
    kept, squares = with_squares(SITES, SquareRules(share=1.0, width=WIDTH), 0)
    assert len(squares) >= 3
    before, after = (shapely.polygons(sites.polygons()) for sites in (SITES, kept))
    left = {shape.wkb for shape in before} - {shape.wkb for shape in after}
    assert len(left) == len(before) - len(after)
    taken = shapely.union_all([shapely.from_wkb(wkb) for wkb in left])
    whole = shapely.union_all([square.shape for square in squares])
    assert whole.symmetric_difference(taken).area < 0.01 * taken.area
    widest = np.linalg.norm(SITES.fronts[:, 1] - SITES.fronts[:, 0], axis=1).max()
    for square in squares:
        # The street runs along x.
        x0, _, x1, _ = square.shape.bounds
        assert WIDTH[0] - 0.01 <= x1 - x0 <= WIDTH[1] + widest
        assert not shapely.overlaps(square.shape, shapely.buffer(after, -0.4)).any()


def test_a_share_of_the_plots_gives_way() -> None:
    assert with_squares(SITES, SquareRules(share=0.0), 0) == (SITES, ())
    rules = SquareRules(share=0.2, width=WIDTH)
    taken = [len(SITES) - len(with_squares(SITES, rules, seed)[0]) for seed in range(40)]
    first_rows = np.count_nonzero(SITES.rows == 0)
    # Ends of rows have no room, so it is less.
    assert 0.4 * 0.2 < np.mean(taken) / first_rows < 0.2


def test_a_square_is_land_of_its_class_and_a_plot() -> None:
    own = replace(PROFILE, squares=replace(PROFILE.squares, share=1.0, width=WIDTH))
    chunks = chunks_of_points(SURFACE.vertices, 100.0)
    maps = RuleProvider().generate(SURFACE, chunks, own, 0)
    # Sidewalks behind the ends of the road have the class, too, and are no plots.
    cells = sum(
        np.count_nonzero((m.classes == LanduseClass.SQUARE) & (m.plots > 0)) for m in maps.values()
    )
    plots = [p for p in find_plots(maps, SURFACE) if p.landuse == LanduseClass.SQUARE]
    assert len(plots) >= 3
    area = sum(shapely.Polygon(plot.polygon).area for plot in plots)
    assert cells * CELL_SIZE**2 == pytest.approx(area, rel=0.05)
    # The street is the nearest road.
    assert all(plot.road for plot in plots)
