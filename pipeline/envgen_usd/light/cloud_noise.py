"""Cloud patterns: fractal noise on a plane above the observer."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import FloatArray, IntArray

Values: TypeAlias = NDArray[np.float32]

_CELLS = 64
"""Side of the periodic lattice of random values; a power of two."""
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


def _fractal(directions: FloatArray, size: float, rng: np.random.Generator) -> Values:
    """Sums octaves of a random lattice, N."""
    corners = _bilinear(rng.random((_CELLS, _CELLS)))
    plane = directions[:, :2] / (directions[:, 2:] + _LOWEST) / size
    # Apart, the coordinates are seven times faster than as rows of two numbers.
    x, y = np.ascontiguousarray(plane.T, np.float32)
    total, weight = np.zeros(len(directions), np.float32), np.float32(1.0)
    along, across = np.float32(0.8 * _FINER), np.float32(0.6 * _FINER)
    for _ in range(_OCTAVES):
        shift = (rng.random(2) * _CELLS).astype(np.float32)
        total += weight * _interpolated(corners, x + shift[0], y + shift[1])
        x, y = along * x - across * y, across * x + along * y
        weight *= np.float32(_FALL)
    return total


def _bilinear(lattice: FloatArray) -> Sequence[Values]:
    """Factors of 1, u, v and u v in each cell of a periodic lattice, flat."""
    next_u, next_v = np.roll(lattice, -1, axis=0), np.roll(lattice, -1, axis=1)
    both = np.roll(next_u, -1, axis=1)
    factors = lattice, next_u - lattice, next_v - lattice, both - next_u - next_v + lattice
    return [each.astype(np.float32).reshape(-1) for each in factors]


def _interpolated(factors: Sequence[Values], u: Values, v: Values) -> Values:
    """Values of a periodic lattice at places in units of its cells, which are overwritten.

    SciPy's `map_coordinates` does the same in double precision in more than twice the time.
    """
    row, column = np.floor(u), np.floor(v)
    u -= row
    v -= column
    periodic = _CELLS - 1
    cells = (row.astype(np.int64) & periodic) * _CELLS + (column.astype(np.int64) & periodic)
    one, by_u, by_v, by_both = (each.take(cells) for each in factors)
    by_both *= u
    by_both += by_v
    by_both *= v
    by_u *= u
    by_both += by_u
    by_both += one
    return by_both


def _ranks(values: Values, sample: Values) -> FloatArray:
    """Returns the share of a sample below each value, N."""
    steps = np.quantile(sample, np.linspace(0.0, 1.0, _STEPS))
    ranks: FloatArray = np.interp(values, steps, np.linspace(0.0, 1.0, _STEPS))
    return ranks
