"""Levels plots: planes that start at the street and slope gently behind it."""

from collections.abc import Sequence

import numpy as np
import shapely
from rasterio.features import rasterize
from rasterio.transform import Affine
from scipy.spatial import cKDTree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.landuse import Plot
from envgen_usd.terrain.height_lattice import Extent, Lattice

ROOM = 2.0
"""Metres along a plot's border reserved for banks; a larger value gives gentler banks."""
SLOPE = 0.08
"""Steepest slope of a plot away from the street, metres per metre."""
STREET_SLOPE = 0.15
"""Steepest slope of a plot along the street, metres per metre."""
NEIGHBOURS = 1.5
"""Largest distance in metres between the fronts of neighbouring plots."""
PASSES = 6
"""Averaging passes over the slopes of neighbours; a larger value makes them more similar."""
FRONT = np.linspace(-0.5, 0.5, 7)
"""Positions along a plot's street side where the ground is sampled, as shares of its width."""


def level_plots(ground: Lattice, plots: Sequence[Plot]) -> FloatArray:
    """Computes the ground heights of plots.

    Each plot becomes a plane. Along the street it follows the ground at the plot's street side.
    Away from the street it fits the former ground (least squares), within buildable slopes and
    similar to its neighbours.

    Args:
        ground: Heights including the embedded road.
        plots: Disjoint plots.

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
    """Averages the slopes of plots with adjacent fronts, because banks between are narrow."""
    ends, starts = cKDTree(fronts[:, 1]), cKDTree(fronts[:, 0])
    pairs = ends.sparse_distance_matrix(starts, NEIGHBOURS, output_type="coo_matrix")
    plot, neighbour = np.concatenate([[pairs.row, pairs.col], [pairs.col, pairs.row]], axis=1)
    count = 1.0 + np.bincount(plot, minlength=len(slopes))
    for _ in range(PASSES):
        slopes = (slopes + np.bincount(plot, slopes[neighbour], len(slopes))) / count
    return slopes


def _numbers(extent: Extent, plots: Sequence[Plot]) -> np.ndarray:
    """Returns 1 + index of the plot whose inner part contains each node, H x W; 0 outside."""
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
    """Returns the height at the centre of each street side, and the slope of the fitted line."""
    places = middle[:, None] + (FRONT * length[:, None])[..., None] * along[:, None]
    heights = ground(places.reshape(-1, 2)).reshape(len(middle), -1)
    slope = heights @ FRONT / np.sum(FRONT**2) / length
    return heights.mean(axis=1), np.clip(slope, -STREET_SLOPE, STREET_SLOPE)
