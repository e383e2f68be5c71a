"""Depths of plots at the street: half of shallow blocks, and the land behind them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.land_areas import union, without
from envgen_usd.landuse.plot_rectangles import LEAST_HALF
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.land_rules import PlotRules

RAYS = (0.1, 0.5, 0.9)
"""Shares of a front at which the depth of its block is measured."""
DEEPER = (1.1, 1.2, 1.3, 1.45, 1.6, 1.8, 2.0, 2.3)
"""Tried depths of plots with land behind them, in depths that they had without it."""
DEEPEST = (1.5, 1.1)
"""Largest depth of a plot with the land behind it, in greatest depths of the rules.

A larger value leaves less land in the middle of deep blocks. The second value holds where that land
gets plots of its own.
"""
JOINT = 0.05
"""Overlap of plots that only touch, metres; a larger value lets them grow into one another."""


def shared_depths(sites: Sites, outline: Outline, rules: PlotRules) -> Sites:
    """Limits the depths of plots to half of their block, so that rows lie back to back.

    Blocks that are too shallow for two rows, and rules with several rows, keep the drawn depths.

    Args:
        sites: Candidate sites.
        outline: Outline of the road.
        rules: Sizes of plots.
    """
    if not len(sites) or rules.rows > 1:
        return sites
    reach = 2.0 * rules.depth[1] + rules.verge[1]
    half = (_block_depths(sites, outline, reach) - rules.verge[1]) / 2.0
    shallow = (half < sites.depths) & (half >= LEAST_HALF * rules.depth[0]) & (sites.rows == 0)
    return replace(sites, depths=np.where(shallow, half, sites.depths))


def _block_depths(sites: Sites, outline: Outline, reach: float) -> FloatArray:
    """Distance of each front from the next road behind it, P; infinite beyond a reach in metres."""
    share = np.array(RAYS)[:, None]
    starts = sites.fronts[:, :1] + share * (sites.fronts[:, 1:] - sites.fronts[:, :1])  # P x R x 2
    normal = sites.normals.mean(axis=1, keepdims=True)
    starts, step = (starts + 0.5 * normal).reshape(-1, 2), np.repeat(normal, len(RAYS), axis=1)
    step = step.reshape(-1, 2)
    edges = np.stack([outline.start[:, :2], outline.end[:, :2]], axis=1)
    rays = shapely.linestrings(np.stack([starts, starts + reach * step], axis=1))
    ray, edge = shapely.STRtree(shapely.linestrings(edges)).query(rays, "intersects")
    along = edges[edge, 1] - edges[edge, 0]
    offset = edges[edge, 0] - starts[ray]
    cross = step[ray, 0] * along[:, 1] - step[ray, 1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / cross
    nearest = np.full(len(starts), np.inf)
    np.minimum.at(nearest, ray, np.where(np.isfinite(away), away, np.inf))
    depths: FloatArray = nearest.reshape(-1, len(RAYS)).min(axis=1) + 0.5
    return depths


def deepened(
    sites: Sites,
    land: shapely.Geometry,
    others: Sequence[shapely.Geometry],
    rules: PlotRules,
    *,
    has_inner: bool,
) -> list[shapely.Geometry]:
    """Plots with the land behind them: all grow in turn, until they meet.

    Args:
        sites: Plots that fit.
        land: Land without the plots.
        others: Land that is no longer free.
        rules: Sizes of plots.
        has_inner: True where deep blocks get inner plots.

    Returns:
        The shapes of the sites.
    """
    cores = shapely.buffer(np.array([shapely.polygons(sites.polygons())]), -JOINT)[0]
    shapes = list(shapely.polygons(sites.polygons()))
    largest = shapely.polygons(sites.polygons(DEEPER[-1]))
    near: list[list[int]] = [[] for _ in shapes]
    for first, second in shapely.STRtree(largest).query(largest, "intersects").T.tolist():
        if first != second:
            near[first].append(second)
    free = shapely.buffer(without(land, union(others)), JOINT)
    shapely.prepare(free)
    grows = np.ones(len(sites), bool)
    before = 1.0
    for share in DEEPER:
        grows &= share * sites.depths <= DEEPEST[has_inner] * rules.depth[1]
        added = _between(sites, before, share)
        grows &= shapely.covers(free, added)
        wider = shapely.polygons(sites.polygons(share))
        for number in np.flatnonzero(grows).tolist():
            if shapely.intersects(added[number], [cores[index] for index in near[number]]).any():
                grows[number] = False
                continue
            shapes[number] = wider[number]
            cores[number] = shapely.buffer(wider[number], -JOINT)
        before = share
    return shapes


def _between(sites: Sites, first: float, second: float) -> NDArray[np.object_]:
    """The land of each site between two shares of its depth."""
    near, far = sites.polygons(first)[:, 2:], sites.polygons(second)[:, 2:]
    added: NDArray[np.object_] = shapely.polygons(np.concatenate([near[:, ::-1], far], axis=1))
    return added
