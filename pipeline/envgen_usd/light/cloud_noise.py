"""Cloud patterns: fractal noise on a plane above the observer."""

import numpy as np
from scipy.ndimage import map_coordinates

from envgen_usd.models.array_types import FloatArray, IntArray

_CELLS = 64
"""Side of the periodic lattice of random values."""
_OCTAVES = 6
"""Number of octaves; a larger value gives finer wisps."""
_FALL = 0.55
"""Amplitude of an octave as a share of the one before; a larger value gives rougher clouds."""
_FINER = 2.03
"""Frequency of an octave as a multiple of the one before; no whole number, so cells do not align.

"""
_SAMPLED, _STEPS = 37, 65
"""Every so many values are ranked, in so many steps; more steps spread the values more evenly."""
_LOWEST = 0.08
"""Sine of the elevation that is added before the projection; keeps the horizon finite."""


def cloud_noise(directions: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    """Returns a value from 0 to 1 for each direction, uniformly distributed over the sky.

    Args:
        directions: N x 3, unit vectors above the horizon.
        size: Size of the largest clouds as a multiple of their height.
        rng: Draws the pattern.
    """
    heights = _fractal(directions, size, rng)
    return _ranks(heights, heights[::_SAMPLED])


def cloud_noise_at(
    chosen: IntArray, directions: FloatArray, size: float, rng: np.random.Generator
) -> FloatArray:
    """Returns the values of `cloud_noise` for some of its directions, in a fraction of the time.

    Args:
        chosen: C, places among the directions.
        directions: As of `cloud_noise`.
        size: As of `cloud_noise`.
        rng: As of `cloud_noise`.
    """
    sample = directions[::_SAMPLED]
    heights = _fractal(np.concatenate((sample, directions[chosen])), size, rng)
    return _ranks(heights[len(sample) :], heights[: len(sample)])


def _fractal(directions: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    """Sums octaves of a random lattice, N."""
    lattice = rng.random((_CELLS, _CELLS))
    # Apart, the coordinates are seven times faster than as rows of two numbers.
    x, y = np.ascontiguousarray((directions[:, :2] / (directions[:, 2:] + _LOWEST) / size).T)
    total, weight = np.zeros(len(directions)), 1.0
    for _ in range(_OCTAVES):
        shift = rng.random(2) * _CELLS
        place = np.stack((x + shift[0], y + shift[1]))
        total += weight * map_coordinates(lattice, place, order=1, mode="grid-wrap")
        x, y = _FINER * (0.8 * x - 0.6 * y), _FINER * (0.6 * x + 0.8 * y)
        weight *= _FALL
    return total


def _ranks(values: FloatArray, sample: FloatArray) -> FloatArray:
    """Returns the share of a sample below each value, N."""
    steps = np.quantile(sample, np.linspace(0.0, 1.0, _STEPS))
    ranks: FloatArray = np.interp(values, steps, np.linspace(0.0, 1.0, _STEPS))
    return ranks
