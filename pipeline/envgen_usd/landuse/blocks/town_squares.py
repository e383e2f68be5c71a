"""Town squares, in the place of plots side by side at a street."""

from collections.abc import Iterator

import numpy as np
import shapely

from envgen_usd.landuse.blocks.laid_plot import LaidPlot
from envgen_usd.landuse.blocks.land_areas import largest
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.land_rules import SquareRules
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.seeds import Draws

_JOINED = 0.3
"""Largest distance of the fronts of plots side by side, metres."""
_STRAIGHT = np.cos(np.radians(15.0))
"""Cosine of the largest turn between the first and the last front of a square."""


def with_squares(sites: Sites, rules: SquareRules, seed: int) -> tuple[Sites, tuple[LaidPlot, ...]]:
    """Gives plots at the street to squares.

    Plots side by side become a square as soon as they are as wide together as it is; a plot lies
    between two squares. The place of its first plot decides alone, so that parts of a map agree.

    Args:
        sites: Plots that fit, in the order of their roadsides.
        rules: Share and widths of squares.
        seed: The user's seed.

    Returns:
        The other plots, and the squares.
    """
    if rules.share <= 0.0:
        return sites, ()
    lengths = np.linalg.norm(sites.fronts[:, 1] - sites.fronts[:, 0], axis=1)
    shapes = shapely.polygons(sites.polygons())
    free = np.ones(len(sites), np.bool_)
    squares = []
    for first in np.flatnonzero(sites.rows == 0).tolist():
        x, y = sites.fronts[first].mean(axis=0)
        draws = Draws(seed, "landuse", "square", f"{x:.0f} {y:.0f}")
        run = _run(first, sites, lengths, draws.within("width", rules.width))
        # As many squares as give the share of all plots.
        is_chosen = draws.share("square") < rules.share / max(len(run), 1)
        before = [first - 1] if first and sites.sides[first - 1] == sites.sides[first] else []
        if not run or not is_chosen or not free[[*before, *run]].all():
            continue
        free[run] = False
        whole = shapely.buffer(shapely.union_all(shapes[run]), _JOINED, join_style="mitre")
        shape = largest(shapely.buffer(whole, -_JOINED, join_style="mitre"))
        squares.append(LaidPlot(shape, LanduseClass.SQUARE))
    kept = np.flatnonzero(free)
    return sites.take(kept, np.ones(len(kept))), tuple(squares)


def _run(first: int, sites: Sites, lengths: FloatArray, width: float) -> list[int]:
    """The plots from one on that are as wide as a square; none where the street ends or bends."""
    run: list[int] = []
    for number in _side_by_side(first, sites):
        run.append(number)
        if lengths[run].sum() >= width:
            break
    else:
        return []
    ends = sites.fronts[[run[0], run[-1]]]
    along = (ends[:, 1] - ends[:, 0]) / lengths[[run[0], run[-1]], None]
    return run if along[0] @ along[1] >= _STRAIGHT else []


def _side_by_side(first: int, sites: Sites) -> Iterator[int]:
    """A plot and those that follow it without a gap in the first row of its roadside."""
    yield first
    for number in range(first + 1, len(sites)):
        is_beside = sites.sides[number] == sites.sides[first] and sites.rows[number] == 0
        gap = np.abs(sites.fronts[number, 0] - sites.fronts[number - 1, 1]).max()
        if not is_beside or gap > _JOINED:
            return
        yield number
