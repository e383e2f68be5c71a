"""Streets behind the ends of roads: houses close the view, and nothing stands in anything's way."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.land_part import LandPart
from envgen_usd.landuse.landuse_rules import RuleProvider, lay_out
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.road_stubs import LENGTH
from envgen_usd.models.landuse import LanduseClass

ROAD = {"road": np.linspace([0.0, 0.0], [150.0, 0.0], 16)}


def profile_of(area="residential", ends=1.0):
    profile = read_profile("1", area)
    return replace(profile, blocks=replace(profile.blocks, ends=ends))


def behind(layout):
    """Plots whose middle lies behind one of both ends."""
    x = shapely.get_x(shapely.centroid(layout.plots))
    return layout.plots[(x < -5.0) | (x > 155.0)]


@pytest.mark.parametrize("area", ["residential", "suburb", "city_centre"])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_view_along_the_road_ends_at_a_plot_for_a_house(make_roads, area, seed):
    surface = make_roads(ROAD)
    layout = lay_out(surface, profile_of(area), seed)
    rays = [shapely.LineString([(x, 0.0), (x + dx, 0.0)]) for x, dx in ((150.0, 80.0), (0, -80.0))]
    for ray in rays:
        hit = layout.plots[shapely.intersects(layout.plots, ray)]
        assert len(hit)
        # The carriageway and both sidewalks of the street across, and a verge, lie before it.
        away = shapely.distance(hit, shapely.Point(ray.coords[0])).min()
        assert LENGTH + 9.0 <= away <= LENGTH + 15.0
    assert len(behind(layout)) > 6


def test_plots_overlap_neither_each_other_nor_ways_and_roads(make_roads):
    surface = make_roads({**ROAD, "other": np.linspace([60.0, 90.0], [240.0, 90.0], 19)})
    layout = lay_out(surface, profile_of(), 0)
    assert np.unique(layout.numbers).size == len(layout.plots) == len(layout.landuse)
    own = behind(layout)
    plot, other = shapely.STRtree(layout.plots).query(own, "intersects")
    beside = ~shapely.equals(own[plot], layout.plots[other])
    shared = shapely.intersection(own[plot[beside]], layout.plots[other[beside]])
    assert shapely.area(shared).max() < 0.05  # they may touch by 5 cm (`TOUCH`)
    paved = shapely.union_all([*layout.ends, *layout.walks])
    assert shapely.area(shapely.intersection(behind(layout), paved)).max() < 1.0
    outline = shapely.union_all([shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()])
    assert shapely.distance(behind(layout), outline).min() > 0.3


def test_the_map_shows_ways_walks_and_plots_with_a_front_at_the_way(make_roads):
    surface, profile = make_roads(ROAD), profile_of()
    chunks = chunks_of_points(surface.vertices, land_beside(profile))
    maps = RuleProvider().generate(surface, chunks, profile, 0)
    layout = lay_out(surface, profile, 0)
    ways, driveways = shapely.union_all(layout.ends), shapely.union_all(layout.driveways)
    onto = shapely.box(0.0, -50.0, 150.0, 50.0)  # the road itself
    walks = shapely.union_all(layout.walks) - ways
    for kind, shape in ((LanduseClass.ROAD_END, ways), (LanduseClass.SQUARE, walks)):
        cells = sum(np.count_nonzero(one.classes == kind) for one in maps.values())
        seen = (shape - driveways - onto).area
        assert cells * (200.0 / 255.0) ** 2 == pytest.approx(seen, rel=0.04)
    plots = [plot for plot in find_plots(maps, surface) if plot.polygon[:, 0].mean() > 155.0]
    assert len(plots) > 5
    for plot in plots:
        middle = shapely.Point(plot.frontage.mean(axis=0))
        assert ways.distance(middle) < 6.0
        assert plot.access is not None


def test_no_street_crosses_another_road(make_roads):
    """A road lies across, 30 m behind the eastern end; the western end is free."""
    across = np.linspace([180.0, -80.0], [180.0, 80.0], 17)
    layout = lay_out(make_roads({**ROAD, "across": across}), profile_of(), 0)
    x, y = shapely.get_coordinates(shapely.centroid(layout.walks)).T
    beside = np.abs(y) < 60.0  # others belong to the ends of the road across
    assert np.count_nonzero(beside & (x < 0.0)) == 5
    assert not (beside & (x > 0.0)).any()


def test_a_share_of_the_ends_and_a_map_that_ends_before(make_roads):
    surface = make_roads(ROAD)
    assert not len(lay_out(surface, profile_of(ends=0.0), 0).walks)
    narrow = profile_of()
    blocks = replace(narrow.blocks, fields=0.0, field_width=0.0, forest=0.0, outer_rows=1)
    layout = lay_out(surface, replace(narrow, blocks=blocks), 0)
    assert not len(layout.walks)
    assert len(layout.ends) == 2


def test_all_land_behind_an_end_belongs_to_the_part_that_has_it(make_roads):
    surface, profile = make_roads(ROAD), profile_of()
    whole = lay_out(surface, profile, 0)
    parts = [
        lay_out(surface, profile, 0, LandPart(bounds, np.array([75.0, 0.0]), 80.0, first))
        for bounds, first in (((-400, -400, 80, 400), 1), ((80, -400, 500, 400), 1000))
    ]
    for name in ("ends", "walks"):
        joined = np.concatenate([getattr(part, name) for part in parts])
        assert {shape.wkb for shape in joined} == {shape.wkb for shape in getattr(whole, name)}
        assert all(len(getattr(part, name)) for part in parts)
    both = np.concatenate([behind(part) for part in parts])
    assert {shape.wkb for shape in both} == {shape.wkb for shape in behind(whole)}
