from dataclasses import replace

import numpy as np
import pytest
import shapely
from tests.environments import TABLE_A1

from envgen_usd.chunks import CELL_SIZE, Chunk, chunks_of_points
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import BlockRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

WINDING = [("winding", c, a) for c, areas in known_environments().items() for a in areas]
"""Bends are what breaks plots, so every environment has to lay plots along them."""
OTHERS = [(name, *environment) for name in ("straight", "x") for environment in TABLE_A1]


def rectangle(centre, size, degrees) -> shapely.Polygon:
    x, y = np.array(size) / 2
    box = shapely.affinity.rotate(shapely.box(-x, -y, x, y), degrees)
    return shapely.affinity.translate(box, *centre)


def painted(polygons, chunks) -> dict[Chunk, LanduseMap]:
    """Maps on which cells are a plot if their centre is in its polygon."""
    maps = {}
    for chunk in chunks:
        x, y = np.meshgrid(*chunk.cell_centres())
        plots = np.zeros(x.shape, dtype=np.int64)
        for number, polygon in enumerate(polygons, 1):
            plots[shapely.contains_xy(polygon, x, y)] = number
        classes = np.where(plots > 0, LanduseClass.LAWN, LanduseClass.GRASS).astype(np.uint8)
        maps[chunk] = LanduseMap(chunk, classes, plots)
    return maps


def road_area(surface) -> shapely.Geometry:
    rings = [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()]
    outer = shapely.union_all([ring for ring in rings if ring.exterior.is_ccw])
    holes = shapely.union_all([ring for ring in rings if not ring.exterior.is_ccw])
    return shapely.difference(outer, holes)


def check_disjoint(plots, road) -> np.ndarray:
    """Plots are nearly convex and overlap neither one another nor the road."""
    # Most have four corners; plots in gaps and at corners take the shape of the land.
    assert sum(len(plot.polygon) == 4 for plot in plots) >= 0.75 * len(plots)
    shapes = np.array([shapely.Polygon(plot.polygon) for plot in plots])
    full = shapely.area(shapes) / shapely.area(shapely.convex_hull(shapes))
    assert np.mean(full > 0.9) > 0.9
    assert shapely.is_valid(shapes).all()
    one, other = shapely.STRtree(shapes).query(shapes, "intersects")
    # Without a grid, GEOS 3.14 finds whole plots where two that share an edge only touch.
    overlap = shapely.area(shapely.intersection(shapes[one], shapes[other], grid_size=1e-9))
    assert np.max(overlap[one != other], initial=0.0) < 1e-6
    assert np.max(shapely.area(shapely.intersection(shapes, road))) < 1e-6
    return shapes


@pytest.mark.parametrize("degrees", [0.0, 3.0, 17.0, 45.0, 61.0, 88.0, 122.0])
@pytest.mark.parametrize("size", [(8.0, 40.0), (25.0, 30.0), (80.0, 60.0)])
def test_a_rectangle_comes_back_as_its_rectangle(make_roads, lines, size, degrees):
    truth = rectangle((190.0, 3.0), size, degrees)
    maps = painted([truth], [Chunk(x, y) for x in (0, 1) for y in (-1, 0)])
    (plot,) = find_plots(maps, make_roads(lines["t"]))
    found = shapely.Polygon(plot.polygon)
    assert len(plot.polygon) == 4
    assert found.exterior.is_ccw
    assert found.hausdorff_distance(truth) < 0.6
    assert plot.id == "plot_1"
    assert plot.landuse == LanduseClass.LAWN


def test_plots_in_a_row_share_straight_sides_without_overlap(make_roads, lines):
    row = [rectangle((20 + 9.3 * i, 40.0), (9.3, 35.0), 0.0) for i in range(12)]
    row = [shapely.affinity.rotate(plot, 23.0, origin=(80, 40)) for plot in row]
    plots = find_plots(painted(row, [Chunk(0, 0)]), make_roads(lines["hairpin"]))
    found = [shapely.Polygon(plot.polygon) for plot in plots]
    assert [len(plot.polygon) for plot in plots] == [4] * 12
    for i, one in enumerate(found):
        assert one.hausdorff_distance(row[i]) < 0.6
        for other in found[i + 1 :]:
            assert one.intersection(other).area < 1e-6
    # No land is lost between neighbours either.
    assert shapely.union_all(found).buffer(1e-6).geom_type == "Polygon"


def at_the_street(country: str, area: str) -> Profile:
    """An environment with plots at streets alone; of the others see test_blocks.py."""
    return replace(read_profile(country, area), blocks=BlockRules())


@pytest.mark.parametrize(("name", "country", "area"), [*WINDING, *OTHERS])
def test_plots_of_the_rules_are_disjoint_off_the_road_and_face_it(
    make_roads, lines, name, country, area
):
    surface = make_roads(lines[name])
    chunks = [Chunk(x, y) for x in range(-2, 4) for y in range(-1, 3)]
    profile = at_the_street(country, area)
    maps = RuleProvider().generate(surface, chunks, profile, 0)
    plots = find_plots(maps, surface)
    road = road_area(surface)
    shapes = check_disjoint(plots, road)
    cells = np.concatenate([m.plots[m.plots > 0] for m in maps.values()])
    counts = dict(zip(*np.unique(cells, return_counts=True), strict=True))
    squares = {LanduseClass.SQUARE} if profile.squares.share else set()
    classes = {profile.plots.landuse, *squares}
    for plot, shape in zip(plots, shapes, strict=True):
        number = int(plot.id.removeprefix("plot_"))
        # Half a cell for each step around it.
        most = 0.5 * CELL_SIZE * shape.length
        assert shape.area == pytest.approx(counts[number] * CELL_SIZE**2, abs=most)
        assert plot.landuse in classes
        start, end = plot.frontage
        front = np.flatnonzero(np.all(plot.polygon == start, axis=1))[0]
        assert np.array_equal(plot.polygon[(front + 1) % len(plot.polygon)], end)
        middle = shapely.Point((start + end) / 2)
        # Behind the verge, and the chord of a bend: no road here has a radius below 50 m.
        bend = np.sum((end - start) ** 2) / (8 * 50.0)
        assert middle.distance(road) < profile.plots.verge[1] + bend + 2.0 * CELL_SIZE
        assert plot.road in lines[name]


@pytest.mark.parametrize(
    "name", ["esmini/fabriksgatan", "malidrive/TShapeRoad", "carla_test/Town01"]
)
def test_plots_beside_real_roads_are_disjoint_and_off_the_road(corpus, name):
    surface = build_surface(read_network(corpus / f"{name}.xodr"))
    chunks = chunks_of_points(surface.vertices, 60.0)
    road = road_area(surface)
    full = RuleProvider().generate(surface, chunks, read_profile("1", "residential"), 0)
    check_disjoint(find_plots(full, surface), road)
    maps = RuleProvider().generate(surface, chunks, at_the_street("1", "residential"), 0)
    plots = find_plots(maps, surface)
    shapes = check_disjoint(plots, road)
    assert len(shapes) > 10
    assert len({plot.id for plot in plots}) == len(plots)
    fronts = shapely.points([plot.frontage.mean(axis=0) for plot in plots])
    assert np.max(shapely.distance(fronts, road)) < 8.0


def test_the_paved_access_tells_the_street_side(make_roads, lines):
    truth = rectangle((140.0, 130.0), (20.0, 46.0), 0.0)
    surface = make_roads(lines["t"])
    maps = painted([truth], [Chunk(0, 0)])
    (by_distance,) = find_plots(maps, surface)
    assert np.allclose(by_distance.frontage[:, 1], 107.0, atol=0.5)
    x, y = np.meshgrid(*Chunk(0, 0).cell_centres())
    classes = maps[Chunk(0, 0)].classes.copy()
    classes[(np.abs(y - 130) < 2) & (x > 120) & (x < 140)] = LanduseClass.ACCESS
    paved = LanduseMap(Chunk(0, 0), classes, maps[Chunk(0, 0)].plots)
    (by_access,) = find_plots({Chunk(0, 0): paved}, surface)
    assert np.allclose(by_access.frontage[:, 0], 130.0, atol=0.5)


def test_a_way_of_others_along_a_side_does_not_tell_the_street_side(make_roads, lines):
    """The plot's own way crosses its front; a way to land behind it covers a strip of its side."""
    truth = rectangle((140.0, 130.0), (20.0, 46.0), 0.0)
    surface = make_roads(lines["t"])
    maps = painted([truth], [Chunk(0, 0)])
    x, y = np.meshgrid(*Chunk(0, 0).cell_centres())
    classes = maps[Chunk(0, 0)].classes.copy()
    classes[(np.abs(x - 145.0) < 1.5) & (y < 112.0)] = LanduseClass.ACCESS
    classes[(np.abs(x - 130.0) < 2.0) & (y > 106.0) & (y < 160.0)] = LanduseClass.ACCESS
    paved = LanduseMap(Chunk(0, 0), classes, maps[Chunk(0, 0)].plots)
    (plot,) = find_plots({Chunk(0, 0): paved}, surface)
    assert np.allclose(plot.frontage[:, 1], 107.0, atol=0.5)
    assert plot.access == pytest.approx([145.0, 107.0], abs=1.0)


def test_a_plot_that_reaches_onto_the_road_is_cut_at_its_border(make_roads, lines):
    surface = make_roads(lines["t"])
    truth = rectangle((150.0, 110.0), (30.0, 40.0), 0.0)
    (plot,) = find_plots(painted([truth], [Chunk(0, 0)]), surface)
    assert plot.polygon[:, 1].min() == pytest.approx(105.0, abs=1e-6)


def test_a_strip_one_cell_wide_is_a_plot_as_wide(make_roads, lines):
    strip = shapely.box(150.0, 12 * CELL_SIZE, 150.0 + 70 * CELL_SIZE, 13 * CELL_SIZE)
    maps = painted([strip], [Chunk(x, y) for x in (0, 1) for y in (-1, 0)])
    (plot,) = find_plots(maps, make_roads(lines["t"]))
    shape = shapely.Polygon(plot.polygon)
    assert shape.is_valid
    assert shape.area == pytest.approx(strip.area, rel=0.05)


def test_no_plots_where_there_are_none(make_roads, lines):
    assert find_plots(painted([], [Chunk(0, 0)]), make_roads(lines["t"])) == ()
