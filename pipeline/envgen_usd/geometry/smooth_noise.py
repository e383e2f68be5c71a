"""Smooth random fields over the plane."""

import numpy as np

from envgen_usd.models.array_types import FloatArray

WAVES = 48
"""Number of plane waves; a larger value approaches a normal distribution."""


def smooth_noise(
    points: FloatArray, wavelength: float, generator: np.random.Generator
) -> FloatArray:
    """Evaluates a smooth random field with mean 0 and variance 1, approximately normal.

    The field is a sum of plane waves of random direction and phase. A value depends on the position
    alone, not on the grid or chunk.

    Args:
        points: N x 2 or N x 3, metres; only x and y count.
        wavelength: Central wavelength in metres; the waves spread over an octave around it.
        generator: Source of the waves; an equal generator state gives an equal field.
    """
    waves, phases = _draw_waves(wavelength, generator)
    field: FloatArray = np.zeros(len(points))
    for wave, phase in zip(waves, phases, strict=True):
        field += np.cos(points[:, :2] @ wave + phase)
    field *= np.sqrt(2 / WAVES)
    return field


def smooth_noise_grid(
    x: FloatArray, y: FloatArray, wavelength: float, generator: np.random.Generator
) -> FloatArray:
    """Evaluates the same field on a grid, len(y) x len(x), much faster.

    A position has bitwise the same value on every grid.
    """
    waves, phases = _draw_waves(wavelength, generator)
    # With a single column, einsum would add up the waves in another order.
    across = np.append(x, x[-1:])[:, None] * waves[:, 0] + phases
    along = y[:, None] * waves[:, 1]
    north = np.concatenate([np.cos(along), -np.sin(along)], axis=1).T
    east = np.ascontiguousarray(np.concatenate([np.cos(across), np.sin(across)], axis=1).T)
    # A matrix product is avoided because its sums depend on the size of the grid.
    total = np.einsum("kh,kw->hw", north, east, optimize=False)[:, :-1]
    field: FloatArray = total * np.sqrt(2 / WAVES)
    return field


def _draw_waves(wavelength: float, generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draws wave vectors (WAVES x 2, radians per metre) and phases (WAVES, radians)."""
    angle = generator.uniform(0.0, 2 * np.pi, WAVES)
    number = 2 * np.pi / (wavelength * 2 ** generator.uniform(-0.5, 0.5, WAVES))
    phases = generator.uniform(0.0, 2 * np.pi, WAVES)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) * number[:, None], phases
