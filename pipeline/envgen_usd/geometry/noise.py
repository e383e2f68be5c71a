"""Smooth random fields over the plane."""

import numpy as np

from envgen_usd.models.arrays import FloatArray

WAVES = 48


def smooth_noise(
    points: FloatArray, wavelength: float, generator: np.random.Generator
) -> FloatArray:
    """Values of a smooth random field with mean 0 and variance 1, close to normally distributed.

    The field is a sum of plane waves of random direction and phase, so that a value depends on
    the place alone and not on the grid or chunk that asks for it.

    Args:
        points: N x 2 or N x 3, metres; only x and y count.
        wavelength: Middle wavelength in metres; the waves spread over an octave around it.
        generator: Draws the waves; the same generator state gives the same field.
    """
    angle = generator.uniform(0.0, 2 * np.pi, WAVES)
    number = 2 * np.pi / (wavelength * 2 ** generator.uniform(-0.5, 0.5, WAVES))
    phase = generator.uniform(0.0, 2 * np.pi, WAVES)
    waves = np.stack([np.cos(angle), np.sin(angle)]) * number
    field: FloatArray = np.zeros(len(points))
    for wave, shift in zip(waves.T, phase, strict=True):
        field += np.cos(points[:, :2] @ wave + shift)
    field *= np.sqrt(2 / WAVES)
    return field
