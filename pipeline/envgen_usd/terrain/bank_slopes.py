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
    lower = _cones(np.where(fixed, -heights, np.inf), rise)
    np.negative(lower, out=lower)
    narrow = lower > upper
    # A region's grids have millions of nodes: arrays that are no longer wanted take what follows.
    least, most = np.minimum(lower, upper), np.maximum(lower, upper, out=upper)
    clipped = np.clip(heights, least, most, out=least)
    del upper, most
    level = _cones(clipped.copy(), rise)
    level -= _cones(np.negative(clipped, out=lower), rise)
    level /= 2
    np.copyto(level, clipped, where=narrow)
    np.copyto(level, heights, where=fixed)
    return level


def _cones(result: FloatArray, rise: float) -> FloatArray:
    """Makes each node the least value plus `rise` per step of all nodes, in two raster scans."""
    ramp = np.arange(result.shape[1]) * rise
    for order in (range(len(result)), range(len(result) - 1, -1, -1)):
        above = np.full(result.shape[1], np.inf)
        for number in order:
            row = np.minimum(result[number], above + rise)
            row[1:] = np.minimum(row[1:], above[:-1] + np.sqrt(2.0) * rise)
            row[:-1] = np.minimum(row[:-1], above[1:] + np.sqrt(2.0) * rise)
            row = np.minimum.accumulate(row - ramp) + ramp
            row = (np.minimum.accumulate((row + ramp)[::-1]) - ramp[::-1])[::-1]
            result[number] = above = row
    return result
