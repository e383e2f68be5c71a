"""Plots at corners and in gaps of street fronts."""

from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.landuse.blocks.laid_plot import LEAST_USE, LaidPlot, drawn_use, way_into
from envgen_usd.landuse.blocks.land_areas import common, opened
from envgen_usd.landuse.blocks.street_land import StreetLand
from envgen_usd.landuse.plot_rectangles import holds_rectangle, least_rectangle
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.distribution import mean_of
from envgen_usd.models.land_rules import BlockRules, PlotRules
from envgen_usd.seeds import Draws, generator

WIDEST = 2
"""Largest number of mean fronts in a gap that becomes a single plot; wider gaps are divided."""
COMPACT = 0.75
"""Least area of a plot in a gap, as a share of the rectangle around it."""
MOST_AREA = 1.5
"""Largest area of a plot in a gap, as a share of the rules' largest plot."""
USE_FRONT = 40.0
"""Least front of plots with a use that share a long gap, metres.

A larger value gives larger plots.
"""


def gap_plots(
    free: shapely.Geometry, streets: StreetLand, rules: PlotRules, blocks: BlockRules, seed: int
) -> tuple[list[LaidPlot], list[shapely.Geometry]]:
    """Divides the free land at streets.

    A share of `PlotRules.infill` of the gaps becomes plots for houses, as far as the land holds the
    least rectangle of a plot and is not much wider. Other gaps get a use without a house.

    Args:
        free: Land without plots.
        streets: Streets of the map.
        rules: Sizes of plots.
        blocks: Uses of other land.
        seed: The user's seed.

    Returns:
        Plots; and land that stays open, because the environment names no uses.
    """
    plots: list[LaidPlot] = []
    open_land: list[shapely.Geometry] = []
    for gap in shapely.get_parts(opened(common(free, streets.band))):
        x, y = shapely.get_coordinates(shapely.centroid(gap))[0]
        place = f"{x:.0f} {y:.0f}"
        draws = Draws(seed, "landuse", "uses", place)
        share = rules.infill * streets.density(np.array([x, y]), blocks.falloff)
        is_built = generator(seed, "landuse", "infill", place).uniform() < share
        width = mean_of(rules.frontage) if is_built or not blocks.uses else USE_FRONT
        for number, part in enumerate(_divided(gap, streets, width)):
            front = streets.longest_front(part)
            if front is None:
                continue
            fits = _holds_house(part, front, rules)
            way = way_into(front, streets.away(front.mean(axis=0)))
            if fits and is_built:
                plots.append(LaidPlot(part, rules.landuse, way))
            elif blocks.uses and part.area >= LEAST_USE:
                kind = drawn_use(blocks.uses, part.area, f"use {number}", draws)
                plots.append(LaidPlot(part, kind, way))
            elif fits:
                open_land.append(part)
    return plots, open_land


def _holds_house(part: shapely.Polygon, front: FloatArray, rules: PlotRules) -> bool:
    most = MOST_AREA * rules.frontage[1] * rules.depth[1]
    around = shapely.area(shapely.oriented_envelope(part))
    if not COMPACT * around <= part.area <= most:
        return False
    corners = shapely.get_coordinates(part.exterior)[:-1]
    return holds_rectangle(corners, front[1] - front[0], least_rectangle(rules))


def _divided(part: shapely.Geometry, streets: StreetLand, width: float) -> list[shapely.Geometry]:
    """Land at a street in pieces of a width in metres, cut at right angles to its longest front."""
    front = streets.longest_front(part)
    if front is None:
        return [part]
    along = front[1] - front[0]
    along /= np.linalg.norm(along)
    axes = np.stack([along, [-along[1], along[0]]])
    low, high = (pick(shapely.get_coordinates(part) @ axes.T, axis=0) for pick in (np.min, np.max))
    count = int((high[0] - low[0]) / width)
    if count <= WIDEST:
        return [part]
    corners = np.array(
        [
            [[left, low[1]], [right, low[1]], [right, high[1]], [left, high[1]]]
            for left, right in pairwise(np.linspace(low[0], high[0], count + 1))
        ]
    )
    slabs = shapely.polygons(corners @ axes)
    return [piece for slab in slabs for piece in shapely.get_parts(common(part, slab))]
