"""Form of plots: sizes, the rectangle that each holds, straight sides."""

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.landuse import Plot

FORM = ("frontage", "depth", "holds", "straight")
"""Columns of `plot_form`."""
STEP = 0.5
"""Distance of the places at which a plot is looked at for a rectangle, metres."""
ASKEW = np.radians(5.0)
"""Largest angle between a straight side and the front, or the line across it."""
LIKE = 0.2
"""Largest difference between the sizes of two plots that are alike, as a share."""


def plot_form(plots: Sequence[Plot], asked: tuple[float, float]) -> FloatArray:
    """Form of each plot, P x `FORM`.

    Frontage is the length of the street side, depth the extent across it, metres. `holds` is 1 if
    the plot holds a rectangle of the asked size that is parallel to its front. `straight` is the
    share of the outline that runs along the front or at right angles to it.

    Args:
        plots: Plots with a street side.
        asked: Frontage and depth of the rectangle, metres.
    """
    rows = [_form(plot.polygon, plot.frontage, asked) for plot in plots]
    return np.array(rows).reshape(-1, len(FORM))


def size_score(plots: FloatArray, others: FloatArray) -> float:
    """F1 score of the sizes of two sets of plots: share that pair off with one that is alike.

    Args:
        plots: P x 2, frontage and depth.
        others: Q x 2.
    """
    if not len(plots) or not len(others):
        return 0.0
    ratio = np.log(np.maximum(plots, STEP))[:, None] - np.log(np.maximum(others, STEP))[None]
    alike = csr_array(np.all(np.abs(ratio) <= np.log1p(LIKE), axis=2))
    pairs = np.count_nonzero(maximum_bipartite_matching(alike) >= 0)
    return 2.0 * pairs / (len(plots) + len(others))


def _form(
    polygon: FloatArray, frontage: FloatArray, asked: tuple[float, float]
) -> tuple[float, float, float, float]:
    along = frontage[1] - frontage[0]
    length = float(np.hypot(*along))
    axis = along / max(length, 1e-9)
    inside = (polygon - frontage[0]) @ np.array([axis, [-axis[1], axis[0]]]).T
    sides = np.roll(inside, -1, axis=0) - inside
    lengths = np.hypot(*sides.T)
    turned = np.abs(np.arctan2(sides[:, 1], sides[:, 0])) % (np.pi / 2.0)
    straight = np.minimum(turned, np.pi / 2.0 - turned) <= ASKEW
    share = float(lengths[straight].sum() / max(lengths.sum(), 1e-9))
    return length, float(np.ptp(inside[:, 1])), float(_holds(inside, asked)), share


def _holds(polygon: FloatArray, asked: tuple[float, float]) -> bool:
    """True if a polygon holds a rectangle of the asked width and height, parallel to the axes."""
    shape = shapely.Polygon(polygon)
    shapely.prepare(shape)
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    x, y = (np.arange(a + STEP / 2.0, b, STEP) for a, b in zip(low, high, strict=True))
    width, height = (max(1, int(size / STEP)) for size in asked)
    if len(x) < width or len(y) < height:
        return False
    free = shapely.contains_xy(shape, *np.meshgrid(x, y))
    sums = np.pad(free.astype(np.int64).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    found = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width]
    return bool((found + sums[:-height, :-width] == width * height).any())
