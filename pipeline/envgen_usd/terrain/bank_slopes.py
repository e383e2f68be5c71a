"""Limits slopes beside fixed heights, which yields embankments and cuttings."""

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray


def limit_slopes(heights: FloatArray, fixed: BoolArray, spacing: float, slope: float) -> FloatArray:
    """Limits the slopes of a height grid.

    1. Heights are clipped between the steepest banks up and down from the fixed nodes. These are
       the largest and smallest extension of the fixed heights with that slope (McShane and
       Whitney, 1934).
    2. Steeper ground is cut and filled equally. The result is the mean of two admissible surfaces,
       the highest from below and the lowest from above.

    Between fixed heights that are too close for the slope, the ground is steeper and stays within
    their range.

    Args:
        heights: H x W, metres.
        fixed: H x W, nodes that keep their height.
        spacing: Distance between nodes, metres.
        slope: Steepest slope, metres per metre; a larger value gives shorter banks.

    Returns:
        H x W, metres; fixed nodes unchanged.
    """
    if not fixed.any():
        return heights
    # Paths over eight neighbours are up to 8 % longer than straight lines.
    rise = slope * spacing / np.hypot(1.0, np.sqrt(2.0) - 1.0)
    upper = _cones(np.where(fixed, heights, np.inf), rise)
    lower = -_cones(np.where(fixed, -heights, np.inf), rise)
    clipped = np.clip(heights, np.minimum(lower, upper), np.maximum(lower, upper))
    level = (_cones(clipped, rise) - _cones(-clipped, rise)) / 2
    return np.where(fixed, heights, np.where(lower > upper, clipped, level))


def _cones(values: FloatArray, rise: float) -> FloatArray:
    """Returns the least value plus `rise` per step over all nodes, in two raster scans."""
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
