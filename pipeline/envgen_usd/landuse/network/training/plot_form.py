"""Form of plots: sizes, the rectangle that each holds, straight sides."""

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.plot_rectangles import holds_rectangle, site_rectangles
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.landuse import Plot

FORM = ("frontage", "depth", "holds", "straight")
"""Columns of `plot_form`."""
INTO = 2.0
"""Distance behind a site's front at which its plot is looked up, metres."""
SHORTEST = 0.5
"""Least size that is compared, metres."""
ASKEW = np.radians(5.0)
"""Largest angle between a straight side and the front, or the line across it."""
LIKE = 0.2
"""Largest difference between the sizes of two plots that are alike, as a share."""


def plot_form(plots: Sequence[Plot], asked: FloatArray) -> FloatArray:
    """Form of each plot, P x `FORM`.

    Frontage is the length of the street side, depth the extent across it, metres. `holds` is 1 if
    the plot holds a rectangle of the asked size that is parallel to its front; a cell of the raster
    may lack in either direction. `straight` is the share of the outline that runs along the front
    or at right angles to it.

    Args:
        plots: Plots with a street side.
        asked: P x 2, frontage and depth of each plot's rectangle, metres.
    """
    sizes = (asked - CELL_SIZE).tolist()
    rows = [
        _form(plot.polygon, plot.frontage, (width, depth))
        for plot, (width, depth) in zip(plots, sizes, strict=True)
    ]
    return np.array(rows).reshape(-1, len(FORM))


def asked_sizes(plots: Sequence[Plot], sites: Sites, least: tuple[float, float]) -> FloatArray:
    """Frontage and depth of the rectangle that each plot is asked to hold, P x 2, metres.

    The plot on the middle of a site's front is asked to hold what the site does
    (`site_rectangles`). A plot without a site is asked for the least size.

    Args:
        plots: Plots with a street side.
        sites: Sites that were laid out.
        least: Least frontage and depth, metres.
    """
    sizes = np.tile(np.array(least), (len(plots), 1))
    rectangles = site_rectangles(sites)
    into = np.minimum(INTO, sites.depths / 4.0)[:, None] * sites.normals.mean(axis=1)
    places = shapely.points(sites.fronts.mean(axis=1) + into)
    tree = shapely.STRtree([shapely.Polygon(plot.polygon) for plot in plots])
    site, plot = tree.query(places, "within")
    sizes[plot[::-1]] = rectangles[site[::-1]]
    return sizes


def size_score(plots: FloatArray, others: FloatArray) -> float:
    """F1 score of the sizes of two sets of plots: share that pair off with one that is alike.

    Args:
        plots: P x 2, frontage and depth.
        others: Q x 2.
    """
    if not len(plots) or not len(others):
        return 0.0
    ratio = (
        np.log(np.maximum(plots, SHORTEST))[:, None] - np.log(np.maximum(others, SHORTEST))[None]
    )
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
    holds = holds_rectangle(polygon, along, asked)
    return length, float(np.ptp(inside[:, 1])), float(holds), share
