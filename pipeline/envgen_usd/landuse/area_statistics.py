"""Statistics of an area: how densely, with which buildings, and for what it is built."""

from collections.abc import Sequence

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.plot_territories import BARRIERS
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.models.distribution import Quantiles, mean_of, value_at
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.place import Houses

AREA_STATISTICS = ("built", "footprint", "height", "industrial")
"""Figures of `box_statistics`: share of the land under main buildings; median footprint, m²; mean
height, m, NaN where no building's is known; share of rubble in the land of plots with houses."""
PLOT_LAND = 0.4
"""Share of an area's land that lies in plots with houses; a larger value builds more densely.

The mean of 336 squares of western halves (docs/landuse.md).
"""


def box_statistics(
    classes: ByteArray, houses: Houses, bounds: Sequence[float], storey: float
) -> FloatArray:
    """Statistics of a box: see `AREA_STATISTICS`.

    Args:
        classes: `LanduseClass` values of its cells.
        houses: Main buildings of the place.
        bounds: West, south, east and north end of the box, metres.
        storey: Height of a storey where a building's height is unknown, metres.
    """
    x, y = shapely.get_coordinates(shapely.centroid(houses.footprints)).T
    here = (x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])
    areas = shapely.area(houses.footprints[here])
    heights = np.where(np.isfinite(houses.heights), houses.heights, houses.storeys * storey)[here]
    heights = heights[np.isfinite(heights)]
    land = ~np.isin(classes, BARRIERS)
    plots = np.isin(classes, (LanduseClass.LAWN, LanduseClass.RUBBLE)).sum()
    return np.array(
        [
            areas.sum() / max(1.0, land.sum() * CELL_SIZE**2),
            np.median(areas) if len(areas) else 0.0,
            heights.mean() if len(heights) else np.nan,
            (classes == LanduseClass.RUBBLE).sum() / max(1, plots),
        ]
    )


def environment_statistics(profile: Profile) -> FloatArray:
    """The figures of `AREA_STATISTICS` that an environment makes, without its streets."""
    houses, plots = profile.buildings, profile.plots
    plot = mean_of(plots.frontage) * mean_of(plots.depth)
    footprint = min(mean_of(houses.width) * mean_of(houses.depth), plot)
    median = value_at(houses.width, 0.5) * value_at(houses.depth, 0.5)
    return np.array(
        [
            footprint / plot * plots.occupancy * PLOT_LAND,
            min(median, plot),
            mean_of(houses.storeys) * mean_of(houses.storey_height),
            float(plots.landuse is LanduseClass.RUBBLE),
        ]
    )


def is_learnt(profile: Profile) -> bool:
    """True for an environment whose buildings or plots were learnt from a place."""
    figures = (profile.buildings.width, profile.plots.frontage)
    return any(isinstance(figure, Quantiles) for figure in figures)
