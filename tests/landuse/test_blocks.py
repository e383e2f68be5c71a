"""Blocks are filled: judged on a square block whose size is known, and on a real map."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

_TOWNS = {"carla_test/Town01": 0.85, "carla_test/Town03": 0.75}
"""Least share of the blocks' land in plots."""


def plots_of(surface, profile) -> list[shapely.Polygon]:
    chunks = chunks_of_points(surface.vertices, 60.0)
    maps = RuleProvider().generate(surface, chunks, profile, 3)
    return [shapely.Polygon(plot.polygon) for plot in find_plots(maps, surface)]


def blocks_of(surface) -> list[shapely.Polygon]:
    """Land that roads enclose; islands are smaller than a house with its garden."""
    rings = [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()]
    return [ring for ring in rings if not ring.exterior.is_ccw and ring.area > 1500.0]


def islands_of(surface) -> np.ndarray:
    """A point on each piece of land that roads enclose, up to the largest roundabout of Town03."""
    rings = [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()]
    small = [ring for ring in rings if not ring.exterior.is_ccw and ring.area < 750.0]
    return np.array([ring.representative_point() for ring in small], object)


@pytest.mark.parametrize("name", list(_TOWNS))
def test_blocks_of_real_towns_are_full(corpus, name):
    surface = build_surface(read_network(corpus / f"{name}.xodr"))
    profile = read_profile("1", "residential")
    plots = plots_of(surface, profile)
    # The raster of plots is 0.8 m wide, so neighbours may lie a cell apart.
    built = shapely.union_all(shapely.buffer(plots, 0.4), grid_size=0.001)
    blocks = shapely.buffer(blocks_of(surface), -profile.plots.verge[0])
    inside = shapely.area(shapely.intersection(blocks, built, grid_size=0.001))
    assert inside.sum() >= _TOWNS[name] * shapely.area(blocks).sum()
    # All roads are at least as wide as a lane: the middle of no road has a plot.
    middles = shapely.points(np.concatenate([line.points[:, :2] for line in surface.roads]))
    tree = shapely.STRtree(plots)
    assert not tree.query(middles, "intersects").size
    # Nobody lives on an island of a roundabout or between lanes.
    assert not tree.query(islands_of(surface), "intersects").size


def test_without_infill_gaps_stay_open(make_roads, lines):
    profile = read_profile("1", "residential")
    surface = make_roads(lines["x"])
    areas = []
    for share in (0.0, 0.5, 1.0):
        rules = replace(profile, plots=replace(profile.plots, infill=share))
        areas.append(sum(plot.area for plot in plots_of(surface, rules)))
    assert areas[0] < 0.97 * areas[1]
    assert areas[1] < areas[2]
