"""Ground of plots: planes that begin at the street and rise or fall gently behind it."""

from collections.abc import Sequence

import numpy as np
import shapely
from rasterio.features import rasterize
from rasterio.transform import Affine
from scipy.spatial import cKDTree

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.landuse import Plot
from envgen_usd.terrain.lattice import Extent, Lattice

ROOM = 2.0
"""Metres along a plot's border that are left for banks between it and its neighbours."""
SLOPE = 0.08
"""Steepest ground of a plot away from the street, metres a metre."""
STREET_SLOPE = 0.15
"""The same along the street, which it follows."""
NEIGHBOURS = 1.5
"""Metres between the fronts of neighbours."""
PASSES = 6
"""Times that slopes are averaged with those of both neighbours."""
FRONT = np.linspace(-0.5, 0.5, 7)
"""Places along a plot's street side at which the ground is looked at."""


def level_plots(ground: Lattice, plots: Sequence[Plot]) -> FloatArray:
    """Heights of the ground of plots.

    Each plot is a plane: along the street it follows the ground at the plot's street side, and
    away from it the ground that it replaces (least squares), within slopes that are built on and
    much like those of its neighbours.

    Args:
        ground: Heights with the road laid into them.
        plots: Disjoint.

    Returns:
        H x W, metres; NaN off the plots and within `ROOM` of their borders.
    """
    extent = ground.extent
    number = _numbers(extent, plots)
    row, column = np.nonzero(number)
    heights = np.full(extent.shape, np.nan)
    if not len(row):
        return heights
    plot = number[row, column] - 1
    fronts = np.array([plot.frontage for plot in plots])
    middle, along = fronts.mean(axis=1), fronts[:, 1] - fronts[:, 0]
    length = np.maximum(np.hypot(*along.T), 1e-3)
    along /= length[:, None]
    level, street = _at_the_street(ground, middle, along, length)
    offset = (np.stack([column, row], axis=1) + extent.first) * extent.spacing - middle[plot]
    sideways = np.sum(offset * along[plot], axis=1)
    behind = along[plot, 0] * offset[:, 1] - along[plot, 1] * offset[:, 0]
    front = level[plot] + street[plot] * sideways
    rest = ground.values[row, column] - front
    total = np.bincount(plot, behind * behind, len(plots))
    slope = np.bincount(plot, behind * rest, len(plots)) / np.maximum(total, 1e-9)
    slope = _like_neighbours(np.clip(slope, -SLOPE, SLOPE), fronts)
    heights[row, column] = front + slope[plot] * behind
    return heights


def _like_neighbours(slopes: FloatArray, fronts: FloatArray) -> FloatArray:
    """Makes slopes of plots alike whose fronts follow on one another: banks between are narrow."""
    ends, starts = cKDTree(fronts[:, 1]), cKDTree(fronts[:, 0])
    pairs = ends.sparse_distance_matrix(starts, NEIGHBOURS, output_type="coo_matrix")
    one, other = np.concatenate([[pairs.row, pairs.col], [pairs.col, pairs.row]], axis=1)
    count = 1.0 + np.bincount(one, minlength=len(slopes))
    for _ in range(PASSES):
        slopes = (slopes + np.bincount(one, slopes[other], len(slopes))) / count
    return slopes


def _numbers(extent: Extent, plots: Sequence[Plot]) -> np.ndarray:
    """1 + index of the plot in whose inner part each node lies, H x W; 0 for none."""
    shapes = shapely.buffer(
        [shapely.Polygon(plot.polygon) for plot in plots], -ROOM, join_style="mitre"
    )
    drawn = [(shape, index) for index, shape in enumerate(shapes, 1) if not shape.is_empty]
    if not drawn:
        return np.zeros(extent.shape, dtype=np.int32)
    x, y = (extent.first - 0.5) * extent.spacing
    transform = Affine(extent.spacing, 0.0, x, 0.0, extent.spacing, y)
    numbers: np.ndarray = rasterize(drawn, extent.shape, 0, transform=transform, dtype="int32")
    return numbers


def _at_the_street(
    ground: Lattice, middle: FloatArray, along: FloatArray, length: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Height at the middle of each street side, and slope along it, of the line through it."""
    places = middle[:, None] + (FRONT * length[:, None])[..., None] * along[:, None]
    heights = ground(places.reshape(-1, 2)).reshape(len(middle), -1)
    slope = heights @ FRONT / np.sum(FRONT**2) / length
    return heights.mean(axis=1), np.clip(slope, -STREET_SLOPE, STREET_SLOPE)
