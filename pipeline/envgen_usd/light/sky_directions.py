"""Directions of the pixels of a sky map, and integrals over it."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import FloatArray


@cache
def sky_directions(rows: int) -> FloatArray:
    """Returns the unit vector of each pixel of a sky map, rows x 2 rows x 3 (x east, z up).

    The map is OpenEXR's latitude-longitude map, turned by 90 degrees about x from its y-up to
    z-up: the middle column looks south (-y), a quarter to the left of it east (+x).
    """
    latitude = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    longitude = 2.0 * np.pi * (0.5 - (np.arange(2 * rows) + 0.5) / (2 * rows))
    level = np.cos(latitude)[:, None]
    east, south = level * np.sin(longitude), level * np.cos(longitude)
    up = np.broadcast_to(np.sin(latitude)[:, None], east.shape)
    directions = np.stack([east, -south, up], axis=-1)
    directions.setflags(write=False)
    return directions


def sky_places(directions: FloatArray, rows: int) -> FloatArray:
    """Returns row and column (..., 2) of directions in a map; pixel centres are integers."""
    longitude = np.arctan2(directions[..., 0], -directions[..., 1])
    latitude = np.arcsin(np.clip(directions[..., 2], -1.0, 1.0))
    row = (0.5 - latitude / np.pi) * rows - 0.5
    column = (0.5 - longitude / (2.0 * np.pi)) * 2 * rows - 0.5
    return np.stack([row, column], axis=-1)


@cache
def solid_angles(rows: int) -> FloatArray:
    """Returns the solid angle of the pixels of each row, rows x 1, steradian."""
    borders = np.sin(np.pi * (0.5 - np.arange(rows + 1) / rows))
    angles: FloatArray = (borders[:-1] - borders[1:])[:, None] * np.pi / rows
    return angles


def ground_illuminance(sky: NDArray[np.floating]) -> FloatArray:
    """Returns the illuminance of open, level ground by a sky map, linear RGB."""
    rows = len(sky)
    half = rows // 2  # the upper rows; all pixels of a row are as high
    weight = sky_directions(rows)[:half, :1, 2] * solid_angles(rows)[:half]
    # Whole rows are added several times faster than pixels of three colours.
    columns = (weight * sky[:half].reshape(half, -1)).sum(axis=0)
    total: FloatArray = columns.reshape(-1, 3).sum(axis=0)
    return total
