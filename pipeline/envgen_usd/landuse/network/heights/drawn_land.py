"""Land under random roads: generated hills, or a window of a real elevation model."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.geometry.smooth_noise import smooth_noise
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.seeds import generator

STEEPNESS = (0.01, 0.05)
"""Range of the standard deviation of slope on hills that roads follow, metres per metre."""
WAVELENGTH = (200.0, 600.0)
"""Range of the central wavelength of these hills, metres."""
TILT = 0.03
"""Largest slope of the plane below them, along each axis, metres per metre."""
RELIEF, RELIEF_WAVELENGTH = (0.0, 1.5), (60.0, 140.0)
"""Ranges of standard deviation and wavelength of hills that roads cut through, metres."""
LEVELLED = 15.0
"""Width of the smoothing of a real terrain before roads are draped, metres.

A larger value gives smoother roads.
"""


@dataclass(frozen=True)
class Land:
    """Land without roads.

    Attributes:
        bare: Heights of the land.
        followed: Heights that roads follow: the land without its small hills.
    """

    bare: Heights
    followed: Heights


def draw_land(rng: np.random.Generator) -> Land:
    """Draws hills that a road follows, and smaller hills that it cuts through."""
    tilt = rng.uniform(-TILT, TILT, 2)
    length, relief_length = rng.uniform(*WAVELENGTH), rng.uniform(*RELIEF_WAVELENGTH)
    # The slope along one axis has the standard deviation 2 pi / wavelength / sqrt(2) times that of
    # the waves.
    swell = rng.uniform(*STEEPNESS) * length / (np.sqrt(2.0) * np.pi)
    relief = rng.uniform(*RELIEF)
    seed = int(rng.integers(2**31))

    def followed(points: FloatArray) -> FloatArray:
        noise = smooth_noise(points, length, generator(seed, "land", "swell"))
        heights: FloatArray = points[:, :2] @ tilt + swell * noise
        return heights

    def bare(points: FloatArray) -> FloatArray:
        noise = smooth_noise(points, relief_length, generator(seed, "land", "relief"))
        return followed(points) + relief * noise

    return Land(bare, followed)


def land_of_raster(heights: FloatArray, middle: FloatArray) -> Land:
    """A window of a real terrain as land for roads.

    Args:
        heights: H x W, metres, on cells of heights; row 0 is the south.
        middle: Coordinates of the raster's centre, metres.
    """
    smooth = ndimage.gaussian_filter(heights, LEVELLED / HEIGHT_CELL, mode="nearest")
    return Land(_of_grid(heights, middle), _of_grid(smooth, middle))


def _of_grid(heights: FloatArray, middle: FloatArray) -> Heights:
    """Bilinear heights; outside the raster those of its edge."""
    first = middle - np.array(heights.shape[::-1]) * HEIGHT_CELL / 2 + HEIGHT_CELL / 2

    def at(points: FloatArray) -> FloatArray:
        column, row = ((points[:, :2] - first) / HEIGHT_CELL).T
        sampled: FloatArray = ndimage.map_coordinates(
            heights, [row, column], order=1, mode="nearest"
        )
        return sampled

    return at
