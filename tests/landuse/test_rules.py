from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from scipy import ndimage
from tests.environments import TABLE_A1

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk, chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.end_streets import ACROSS, WALK
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.outer_land import rows_outside
from envgen_usd.landuse.plot_sites import BACK_LANE
from envgen_usd.landuse.road_stubs import LENGTH, road_ends
from envgen_usd.models.land_rules import BlockRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.road_surface import RoadSurface

_PAVED = [LanduseClass.ROAD, LanduseClass.ACCESS, LanduseClass.ROAD_END, LanduseClass.SQUARE]
"""Carriageways, ways into plots and along them, and their sidewalks."""
ROADS = ["straight", "curved", "winding", "hairpin", "t", "x"]


def chunks_of(surface: RoadSurface) -> list[Chunk]:
    return [c for c in chunks_of_points(surface.vertices, 100.0) if abs(c.x) <= 1 and abs(c.y) <= 1]


def mosaic(maps: dict[Chunk, LanduseMap]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Classes, plots and centres of all cells, flat."""
    classes = np.concatenate([m.classes.ravel() for m in maps.values()])
    plots = np.concatenate([m.plots.ravel() for m in maps.values()])
    centres = [np.stack(np.meshgrid(*c.cell_centres()), -1).reshape(-1, 2) for c in maps]
    return classes, plots, np.concatenate(centres)


def road_area(surface: RoadSurface) -> shapely.Geometry:
    rings = [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()]
    outer = [ring for ring in rings if ring.exterior.is_ccw]
    holes = [ring for ring in rings if not ring.exterior.is_ccw]
    return shapely.difference(shapely.union_all(outer), shapely.union_all(holes))


def at_rim(cells: np.ndarray) -> np.ndarray:
    """Those of flat cells that have a neighbour without, or none in their chunk.

    One of them is the nearest to a road that no cell is on, and one is the farthest.
    """
    wide = np.pad(cells.reshape(-1, LANDUSE_CELLS, LANDUSE_CELLS), ((0, 0), (1, 1), (1, 1)))
    across = wide[:, 1:-1, :-2] & wide[:, 1:-1, 2:]
    along = wide[:, :-2, 1:-1] & wide[:, 2:, 1:-1]
    return cells & ~(across & along).ravel()


WIDE = [Chunk(x, y) for x in range(-2, 4) for y in range(-1, 2)]


@pytest.fixture(scope="module")
def land_of(make_roads, lines) -> Callable[[str, str, str], dict[Chunk, LanduseMap]]:
    """Land beside a road of `lines` in an environment as it is shipped, made once for all tests."""

    @cache
    def made(name: str, country: str, area: str) -> dict[Chunk, LanduseMap]:
        profile = read_profile(country, area)
        return RuleProvider().generate(make_roads(lines[name]), WIDE, profile, 0)

    return made


@pytest.mark.parametrize("name", ROADS)
def test_road_cells_are_those_whose_centre_is_on_the_road(make_roads, lines, name):
    surface = make_roads(lines[name])
    maps = RuleProvider().generate(surface, chunks_of(surface), read_profile("1", "residential"), 0)
    classes, plots, centres = mosaic(maps)
    on_road = shapely.contains_xy(road_area(surface), centres)
    assert np.array_equal(classes == LanduseClass.ROAD, on_road)
    assert not plots[on_road].any()
    assert not np.any(classes == LanduseClass.UNKNOWN)


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
@pytest.mark.parametrize("name", ["straight", "winding", "x"])
@pytest.mark.parametrize("has_blocks", [True, False])
def test_plots_have_the_size_and_the_ground_of_the_environment(
    make_roads, lines, land_of, *, name, country, area, has_blocks
):
    profile = read_profile(country, area)
    surface = make_roads(lines[name])
    if has_blocks:
        maps = land_of(name, country, area)
    else:
        profile = replace(profile, blocks=BlockRules())
        maps = RuleProvider().generate(surface, WIDE, profile, 0)
    classes, plots, centres = mosaic(maps)
    # Plots over the rim of these chunks are not whole.
    low, high = np.array([-400.0, -200.0]) + CELL_SIZE, np.array([800.0, 400.0]) - CELL_SIZE
    rim = np.any((centres < low) | (centres > high), axis=1)
    plots[np.isin(plots, np.unique(plots[rim]))] = 0
    uses = {LanduseClass[use.upper()] for use in profile.blocks.uses}
    whole = np.unique(plots[np.isin(classes, list(uses))])
    of_houses = (plots > 0) & ~np.isin(plots, whole)
    numbers, sizes = np.unique(plots[of_houses], return_counts=True)
    assert len(numbers) > 4
    # Depths may shrink to fit; in bends backs are narrower or wider than fronts.
    rules = profile.plots
    assert sizes.min() * CELL_SIZE**2 > 0.5 * rules.frontage[0] * 0.8 * rules.depth[0]
    rows = rows_outside(profile)
    # Outside of a bend, plots of a second row are wider than their fronts.
    most = 1.8 if rows > rules.rows else 1.6
    assert sizes.max() * CELL_SIZE**2 < most * rules.frontage[1] * rules.depth[1]
    inside = classes[plots > 0]
    assert {rules.landuse, LanduseClass.ACCESS} <= set(np.unique(inside))
    assert set(np.unique(inside)) <= {rules.landuse, LanduseClass.ACCESS, *uses}
    road = road_area(surface)
    shapely.prepare(road)
    cells = shapely.points(centres[at_rim(plots > 0)])
    assert not shapely.dwithin(road, cells, rules.verge[0] - CELL_SIZE).any()
    reach = rules.verge[1] + rows * rules.depth[1] + (rows - 1) * BACK_LANE
    beside = shapely.dwithin(road, cells, reach + rules.frontage[1] / 2)
    # Behind the ends of roads stand plots along a street, and others at a street across.
    far = LENGTH + ACROSS + WALK + rules.verge[1] + rules.depth[1]
    for end in road_ends(surface):
        aside = end.width / 2.0 + rules.verge[1] + rules.depth[1]
        behind = shapely.Polygon(end.box(0.0, far, -aside, aside))
        beside |= shapely.dwithin(behind, cells, CELL_SIZE)
    assert beside.all()


def test_both_sides_and_all_arms_of_a_crossing_have_plots(make_roads, lines):
    surface = make_roads(lines["x"])
    chunks = [Chunk(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    maps = RuleProvider().generate(surface, chunks, read_profile("2", "residential"), 0)
    _, plots, centres = mosaic(maps)
    x, y = (centres[plots > 0] - 100.0).T
    for along, across in ((x, y), (y, x)):
        for sign in (-1, 1):
            for side in (-1, 1):
                arm = (sign * along > 60) & (side * across > 5) & (side * across < 45)
                assert arm.sum() > 1000


def test_chunks_do_not_depend_on_one_another(make_roads, lines):
    surface, profile = make_roads(lines["winding"]), read_profile("1", "residential")
    chunks = [Chunk(x, y) for x in (-1, 0, 1) for y in (0, 1)]
    together = RuleProvider().generate(surface, chunks, profile, 4)
    for chunk in chunks:
        alone = RuleProvider().generate(surface, [chunk], profile, 4)[chunk]
        assert np.array_equal(alone.classes, together[chunk].classes)
        assert np.array_equal(alone.plots, together[chunk].plots)


def test_a_plot_is_in_one_piece_over_chunk_borders(make_roads, lines):
    surface, profile = make_roads(lines["straight"]), read_profile("2", "industrial")
    chunks = [Chunk(x, 0) for x in range(-2, 4)]
    maps = RuleProvider().generate(surface, chunks, profile, 0)
    plots = np.concatenate([maps[chunk].plots for chunk in chunks], axis=1)
    crossing = 0
    for number in np.unique(plots[plots > 0]):
        _, parts = ndimage.label(plots == number)
        assert parts == 1
        columns = np.flatnonzero(np.any(plots == number, axis=0)) // LANDUSE_CELLS
        crossing += columns[0] != columns[-1]
    assert crossing > 2


def test_seeds_give_different_plots_and_the_same_seed_the_same(make_roads, lines):
    surface, profile = make_roads(lines["t"]), read_profile("1", "industrial")
    first, again, other = (
        RuleProvider().generate(surface, [Chunk(0, 0)], profile, seed)[Chunk(0, 0)]
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first.classes, again.classes)
    assert np.array_equal(first.plots, again.plots)
    assert not np.array_equal(first.plots, other.plots)


def test_fronts_do_not_repeat_along_a_straight_road(make_roads, lines):
    surface, profile = make_roads(lines["straight"]), read_profile("1", "residential")
    chunks = [Chunk(x, 0) for x in range(-2, 4)]
    maps = RuleProvider().generate(surface, chunks, profile, 0)
    plots = np.concatenate([maps[chunk].plots for chunk in chunks], axis=1)
    sizes = np.unique(plots[plots > 0], return_counts=True)[1]
    assert len(np.unique(sizes)) > 0.5 * len(sizes)


@pytest.mark.parametrize("share", [0.0, 0.25, 0.6, 1.0])
def test_wood_covers_its_share_of_the_free_land(make_roads, lines, share):
    profile = read_profile("1", "industrial")
    profile = replace(profile, plots=replace(profile.plots, wood=share), blocks=BlockRules())
    chunks = [Chunk(x, y) for x in range(6, 10) for y in range(6, 10)]
    surface = make_roads(lines["t"])
    classes, _, _ = mosaic(RuleProvider().generate(surface, chunks, profile, 0))
    assert np.mean(classes == LanduseClass.WOOD) == pytest.approx(share, abs=0.06)


@pytest.mark.parametrize("town", ["motorway", "pedestrian"])
def test_no_plot_opens_onto_a_motorway(make_roads, lines, town):
    surface, profile = make_roads(lines["straight"], town=town), read_profile("1", "residential")
    maps = RuleProvider().generate(surface, chunks_of(surface), profile, 0)
    classes, plots, _ = mosaic(maps)
    assert not plots.any()
    assert {LanduseClass.ROAD, LanduseClass.VERGE} <= set(np.unique(classes))


def test_rows_lie_behind_one_another_with_a_lane_to_each(make_roads, lines):
    profile = read_profile("2", "residential")
    profile = replace(profile, blocks=BlockRules())
    two = replace(profile, plots=replace(profile.plots, rows=2))
    surface = make_roads(lines["straight"])
    chunks = [Chunk(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    one_row, two_rows = (
        mosaic(RuleProvider().generate(surface, chunks, p, 0))[1] for p in (profile, two)
    )
    assert np.sum(two_rows > 0) > 1.6 * np.sum(one_row > 0)


def test_a_map_without_a_road_beside_it_is_grass_and_wood(make_roads, lines):
    surface = make_roads(lines["t"])
    maps = RuleProvider().generate(surface, [Chunk(9, 9)], read_profile("1", "industrial"), 0)
    classes, plots, _ = mosaic(maps)
    assert set(np.unique(classes)) <= {LanduseClass.GRASS, LanduseClass.WOOD}
    assert not plots.any()


def test_wood_has_neither_specks_nor_seams(make_roads, lines):
    profile = replace(read_profile("1", "residential"), blocks=BlockRules())
    chunks = [Chunk(x, y) for y in (2, 3) for x in (6, 7)]
    maps = RuleProvider().generate(make_roads(lines["t"]), chunks, profile, 0)
    wood = np.block([[maps[Chunk(x, y)].classes for x in (6, 7)] for y in (2, 3)])
    wood = wood == LanduseClass.WOOD
    # What lies at the rim of these chunks may be cut there.
    parts, count = ndimage.label(wood)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)
    rim = np.unique(np.concatenate([parts[0], parts[-1], parts[:, 0], parts[:, -1]]))
    whole = np.setdiff1d(np.arange(1, count + 1), rim)
    assert len(whole) > 10
    assert sizes[whole].min() >= 20


def test_a_street_shorter_than_a_plot_has_one_that_fits(make_roads, lines):
    profile = read_profile("2", "industrial")
    street = replace(profile, plots=replace(profile.plots, occupancy=1.0))
    length = float(np.ptp(make_roads(lines["straight"]).vertices[:, 0]))
    wide = (1.2 * length, 1.4 * length)
    narrow = replace(street, plots=replace(street.plots, frontage=wide, gap=(0.0, 1.0)))
    surface = make_roads(lines["straight"])
    _, plots, centres = mosaic(RuleProvider().generate(surface, chunks_of(surface), narrow, 0))
    extents = [np.ptp(centres[plots == n, 0]) for n in np.unique(plots[plots > 0])]
    assert len(extents) == 2
    assert max(extents) <= length + CELL_SIZE


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
@pytest.mark.parametrize("rows", [1, 2])
def test_every_paved_way_leads_to_a_road(make_roads, lines, land_of, *, country, area, rows):
    shipped = read_profile(country, area)
    profile = replace(shipped, plots=replace(shipped.plots, rows=rows))
    for name in ("winding", "x"):
        if rows == shipped.plots.rows:
            maps = land_of(name, country, area)
        else:
            chunks = [Chunk(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1, 2)]
            maps = RuleProvider().generate(make_roads(lines[name]), chunks, profile, 0)
        classes = np.block([[maps[Chunk(x, y)].classes for x in (-1, 0, 1, 2)] for y in (-1, 0, 1)])
        paved = np.isin(classes, _PAVED)
        parts, _ = ndimage.label(paved, np.ones((3, 3)))
        rim = (parts[0], parts[-1], parts[:, 0], parts[:, -1])
        known = np.unique(np.concatenate([parts[classes == LanduseClass.ROAD], *rim]))
        alone = np.bincount(parts.ravel())
        alone[known] = 0
        # Slivers of a lane that something else lies on are no ways.
        assert alone[1:].max(initial=0) <= 8
