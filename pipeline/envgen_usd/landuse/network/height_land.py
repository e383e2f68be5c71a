"""Land that roads are drawn on: seeded hills, or a piece of a real elevation model."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.geometry.noise import smooth_noise
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.profile import TerrainRules
from envgen_usd.seeds import generator

STEEPNESS = (0.01, 0.05)
"""Range of the standard deviation of the slope of hills that roads follow, metres a metre."""
WAVELENGTH = (200.0, 600.0)
"""Range of the middle wavelength of such hills, metres."""
TILT = 0.03
"""Largest slope of the plane below them, along each axis."""
RELIEF, RELIEF_WAVELENGTH = (0.0, 1.5), (60.0, 140.0)
"""Ranges of the standard deviation and of the wavelength of what roads do not follow, metres."""
BANKS = (0.35, 0.7)
"""Range of the steepest slope of banks, metres a metre."""
LEVELLED = 15.0
"""Metres over which a real terrain is smoothed before a road is drawn on it."""


@dataclass(frozen=True)
class Land:
    """Land without a road.

    Attributes:
        bare: Its heights.
        followed: What a road follows of them: the land without its small hills.
        rules: Relief of the rest, and slope of banks.
    """

    bare: Heights
    followed: Heights
    rules: TerrainRules


def draw_land(rng: np.random.Generator) -> Land:
    """Draws hills that a road follows, and smaller ones that it cuts through."""
    tilt = rng.uniform(-TILT, TILT, 2)
    length, relief_length = rng.uniform(*WAVELENGTH), rng.uniform(*RELIEF_WAVELENGTH)
    # The slope of waves along one axis has the deviation 2 pi / wavelength / sqrt(2) of theirs.
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

    return Land(bare, followed, TerrainRules(relief, relief_length, rng.uniform(*BANKS)))


def land_of_raster(heights: FloatArray, middle: FloatArray, rng: np.random.Generator) -> Land:
    """A piece of a real terrain as land to draw roads on.

    Args:
        heights: H x W, metres, on cells; row 0 is the south.
        middle: Place of the raster's middle, metres.
        rng: Draws the slope of banks.
    """
    smooth = ndimage.gaussian_filter(heights, LEVELLED / CELL_SIZE, mode="nearest")
    relief = float(np.std(heights - smooth))
    rules = TerrainRules(relief, sum(RELIEF_WAVELENGTH) / 2, rng.uniform(*BANKS))
    return Land(_of_grid(heights, middle), _of_grid(smooth, middle), rules)


def _of_grid(heights: FloatArray, middle: FloatArray) -> Heights:
    """Bilinear heights; beyond the raster those of its edge."""
    first = middle - np.array(heights.shape[::-1]) * CELL_SIZE / 2 + CELL_SIZE / 2

    def at(points: FloatArray) -> FloatArray:
        column, row = ((points[:, :2] - first) / CELL_SIZE).T
        found: FloatArray = ndimage.map_coordinates(heights, [row, column], order=1, mode="nearest")
        return found

    return at
