"""Rectangles that plots are asked to hold, parallel to their street side."""

import numpy as np
import shapely

from envgen_usd.landuse.plot_sites import NARROWEST, Sites
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.land_rules import PlotRules

LEAST_HALF = 0.5
"""Least depth of a plot in a shallow block, as a share of the rules' least depth.

A larger value leaves one side of more blocks empty.
"""
_STEP = 0.5


def site_rectangles(sites: Sites) -> FloatArray:
    """Width and depth of the rectangle on the front of each site, inside of it, P x 2, metres.

    Sites inside of a bend narrow towards their back, so their rectangle is narrower than the front;
    sides that are not at right angles to the front make it shallower.
    """
    along = sites.fronts[:, 1] - sites.fronts[:, 0]
    length = np.linalg.norm(along, axis=1)
    axis = along / np.maximum(length, 1e-9)[:, None]
    across = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
    sides = sites.depths[:, None, None] * sites.normals  # P x 2 x 2
    shifts = np.einsum("pec,pc->pe", sides, axis)
    left = np.maximum(0.0, shifts[:, 0])
    right = np.minimum(length, length + shifts[:, 1])
    depths = np.einsum("pec,pc->pe", sides, across).min(axis=1)
    sizes: FloatArray = np.maximum(np.stack([right - left, depths], axis=1), 0.0)
    return sizes


def least_rectangle(rules: PlotRules) -> tuple[float, float]:
    """Width and depth that a plot with a house holds at least, metres.

    Plots without a site, at corners, in gaps and inside of blocks, ask for no other size.
    """
    return NARROWEST * rules.frontage[0], LEAST_HALF * rules.depth[0]


def holds_rectangle(polygon: FloatArray, along: FloatArray, size: tuple[float, float]) -> bool:
    """True if a polygon holds a rectangle that is parallel to a direction.

    Args:
        polygon: N x 2, without its first point at the end, metres.
        along: 2, direction of the rectangle's width; of any length above 0.
        size: Width and depth of the rectangle, metres; both are rounded down to half metres.
    """
    axis = along / max(float(np.hypot(*along)), 1e-9)
    inside = (polygon - polygon[0]) @ np.array([axis, [-axis[1], axis[0]]]).T
    low, high = inside.min(axis=0), inside.max(axis=0)
    x, y = (np.arange(a + _STEP / 2.0, b, _STEP) for a, b in zip(low, high, strict=True))
    width, height = (max(1, int(one / _STEP)) for one in size)
    if len(x) < width or len(y) < height:
        return False
    shape = shapely.Polygon(inside)
    shapely.prepare(shape)
    free = shapely.contains_xy(shape, *np.meshgrid(x, y))
    sums = np.pad(free.astype(np.int64).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    found = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width]
    return bool((found + sums[:-height, :-width] == width * height).any())
