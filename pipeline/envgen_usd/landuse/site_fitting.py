"""Selects the sites that fit: clear of roads, of decks and of other plots."""

import numpy as np
import shapely

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.models.road_surface import RoadSurface

SHARES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
"""Tried shares of the drawn depth, in this order."""
LEAST_DEPTH = 0.75
"""Least depth of a plot as a share of the rules' smallest depth; a larger value drops more plots.

"""
LEAST_SHARE = 0.8
"""Least share of a drawn depth that is smaller than the rules' smallest (`shared_depths`)."""
LEAST_BACK = 0.5
"""Least width of a plot's back as a share of its front, inside bends.

A larger value drops more plots.
"""
BORDER_TOLERANCE = 2.5
"""Largest distance between a road's border and its outline on the ground, metres.

A larger distance means a bridge, or another road.
"""
LANE_EDGE = 1.0
"""Margin on both sides of a lane that plots may cover, metres; a larger value keeps more plots."""
TOUCH = 0.05
"""Largest overlap of adjacent plots, metres; a larger value keeps more plots."""


def fit_sites(
    sites: Sites, surface: RoadSurface, rules: PlotRules, *, shallow: bool = False
) -> Sites:
    """Keeps the plots that fit, with a reduced depth if necessary.

    The earlier plot takes precedence.

    1. The road beside the plot is on the ground.
    2. The plot keeps the least verge from every road, and does not lie under a bridge.
    3. It does not overlap a plot of higher precedence.
    4. In a back row, no plot lies on the lane to it, and no plot along that lane is missing.

    Args:
        sites: Candidate sites.
        surface: The whole road.
        rules: Sizes of plots.
        shallow: True also keeps plots in blocks that are shallower than the rules' smallest plot.
    """
    outline = Outline.of(surface)
    possible = _at_the_border(sites, outline)
    shapes, fits = [], []
    least = np.full(len(sites), LEAST_DEPTH * rules.depth[0])
    if shallow:
        least = np.minimum(least, LEAST_SHARE * sites.depths)
    for share in SHARES:
        shape = shapely.polygons(sites.polygons(share))
        deep_enough = sites.depths * share >= least
        shapes.append(shape)
        fits.append(possible & deep_enough & _sound(sites.polygons(share)))
    clear = clear_of_roads(np.array(shapes), outline, surface, rules.verge[0])
    chosen = _first_come(np.array(shapes), np.array(fits) & clear)
    kept = chosen >= 0
    kept[kept] = _has_way(sites.take(np.flatnonzero(kept), np.array(SHARES)[chosen[kept]]))
    index = np.flatnonzero(kept & is_reached(sites, kept))
    return sites.take(index, np.array(SHARES)[chosen[index]])


def _has_way(sites: Sites) -> BoolArray:
    """True for plots at the street, and for others whose piece of the lane is clear."""
    free = np.ones(len(sites), dtype=np.bool_)
    back = np.flatnonzero(sites.rows > 0)
    plots = np.concatenate([back, back[sites.heads[back]]])
    tree = shapely.STRtree(shapely.polygons(sites.polygons()))
    lanes = shapely.buffer(shapely.polygons(sites.lanes()), -LANE_EDGE, join_style="mitre")
    free[plots[tree.query(lanes, "intersects")[0]]] = False
    return free


def is_reached(sites: Sites, kept: BoolArray) -> BoolArray:
    """True for plots at the street, and for others up to the first gap of their row."""
    row = np.cumsum(sites.heads) - 1
    missing = np.cumsum(~kept)
    # Plots at the street whose head was left out before may have the row -1.
    before: IntArray = np.append((missing - ~kept)[sites.heads], -1)
    reached: BoolArray = (sites.rows == 0) | (missing == before[row])
    return reached


def _at_the_border(sites: Sites, outline: Outline) -> BoolArray:
    """True if the road's outline lies before both ends of a plot."""
    border = sites.fronts - sites.before[:, None, None] * sites.normals
    distance, _ = outline.nearest(border.reshape(-1, 2))
    at_border: BoolArray = np.all(distance.reshape(-1, 2) <= BORDER_TOLERANCE, axis=1)
    return at_border


def _sound(corners: FloatArray) -> BoolArray:
    """True for quadrilaterals (P x 4 x 2) that are convex, counter-clockwise and wide enough."""
    side = np.roll(corners, -1, axis=1) - corners
    following = np.roll(side, -1, axis=1)
    turn = side[..., 0] * following[..., 1] - side[..., 1] * following[..., 0]
    width = np.linalg.norm(side, axis=2)
    sound: BoolArray = np.all(turn > 0, axis=1) & (width[:, 2] >= LEAST_BACK * width[:, 0])
    return sound


def clear_of_roads(
    shapes: np.ndarray, outline: Outline, surface: RoadSurface, verge: float
) -> BoolArray:
    """True for shapes that keep a distance from roads and do not lie under a bridge.

    Args:
        shapes: Polygons, of any array shape, metres.
        outline: Outline of the road.
        surface: The whole road.
        verge: Least distance, metres.
    """
    clear = np.ones(shapes.shape, dtype=np.bool_)
    edges = np.stack([outline.start[:, :2], outline.end[:, :2]], axis=1)
    decks = surface.vertices[surface.triangles[surface.triangle_level > 0], :2]
    tree = shapely.STRtree([*shapely.linestrings(edges), *shapely.polygons(decks)])
    hit = tree.query(shapes.ravel(), predicate="dwithin", distance=verge - TOUCH)[0]
    clear.ravel()[hit] = False
    return clear


def _first_come(shapes: np.ndarray, fits: BoolArray) -> np.ndarray:
    """For each of P plots the first of its S shapes that fits and is still free, or -1."""
    chosen = np.full(shapes.shape[1], -1)
    cores = shapely.buffer(shapes, -TOUCH, join_style="mitre")
    near: list[list[int]] = [[] for _ in chosen]
    for first, second in shapely.STRtree(shapes[0]).query(shapes[0], predicate="intersects").T:
        if second < first:
            near[first].append(second)
    for plot, before in enumerate(near):
        taken = [shapes[chosen[second], second] for second in before if chosen[second] >= 0]
        for share in np.flatnonzero(fits[:, plot]):
            if not np.any(shapely.intersects(cores[share, plot], taken)):
                chosen[plot] = share
                break
    return chosen
