"""Banks and cuttings: heights that nowhere rise faster than a slope away from fixed ones."""

import numpy as np

from envgen_usd.models.arrays import BoolArray, FloatArray


def limit_slopes(heights: FloatArray, fixed: BoolArray, spacing: float, slope: float) -> FloatArray:
    """Brings heights to banks that are nowhere steeper than a slope.

    1. Heights are clipped between the steepest banks up and down from the fixed nodes: the
       largest and the smallest extension of the fixed heights that keeps the slope (McShane and
       Whitney, 1934).
    2. Steeper places are cut and filled alike: the result is the mean of the highest surface
       below and the lowest surface above that keep the slope.

    Where fixed heights lie closer than the slope allows, the ground between them is steeper, and
    stays between the two.

    Args:
        heights: H x W, metres.
        fixed: H x W, the nodes that stay.
        spacing: Distance between nodes, metres.
        slope: Steepest slope, metres a metre.

    Returns:
        H x W; fixed nodes unchanged.
    """
    if not fixed.any():
        return heights
    # Paths over the eight neighbours are up to 8 % longer than straight lines.
    rise = slope * spacing / np.hypot(1.0, np.sqrt(2.0) - 1.0)
    upper = _cones(np.where(fixed, heights, np.inf), rise)
    lower = -_cones(np.where(fixed, -heights, np.inf), rise)
    clipped = np.clip(heights, np.minimum(lower, upper), np.maximum(lower, upper))
    level = (_cones(clipped, rise) - _cones(-clipped, rise)) / 2
    return np.where(fixed, heights, np.where(lower > upper, clipped, level))


def _cones(values: FloatArray, rise: float) -> FloatArray:
    """Least value plus `rise` a step over all nodes, in two raster scans."""
    result = values.copy()
    ramp = np.arange(values.shape[1]) * rise
    for order in (range(len(values)), range(len(values) - 1, -1, -1)):
        above = np.full(values.shape[1], np.inf)
        for number in order:
            row = np.minimum(result[number], above + rise)
            row[1:] = np.minimum(row[1:], above[:-1] + np.sqrt(2.0) * rise)
            row[:-1] = np.minimum(row[:-1], above[1:] + np.sqrt(2.0) * rise)
            row = np.minimum.accumulate(row - ramp) + ramp
            row = (np.minimum.accumulate((row + ramp)[::-1]) - ramp[::-1])[::-1]
            result[number] = above = row
    return result
