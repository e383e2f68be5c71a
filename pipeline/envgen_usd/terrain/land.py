"""The land as it would lie without the road: what the road's course tells, and seeded hills."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.noise import smooth_noise, smooth_noise_grid
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface
from envgen_usd.seeds import generator

TREND_SPREAD = 25.0
"""Standard deviation in metres that the road must have along an axis to tell a slope along it:
the cross-fall of a single road says nothing about the land."""
RELIEF_PEAK = 1.25
"""Standard deviations of the noise that make three quarters of the relief's amplitude."""
PLAIN, MOUNTAINS = 0.5, 1.5
"""Shares of the relief beside the straightest and the most winding roads."""
WINDING = 4e-3
"""Radians of turning a metre that hint at the environment's own relief, half of it at plain and
half of it at mountains."""


def guess_land(surface: RoadSurface, rules: TerrainRules, seed: int) -> Heights:
    """The plane through the road with hills, which are higher beside winding roads.

    Args:
        surface: Road.
        rules: Amplitude and size of the hills.
        seed: The user's seed.
    """
    trend = _trend(Outline.of(surface))
    if not rules.relief:
        return trend
    amplitude = rules.relief * _hint_of_hills(surface)
    return _Hills(trend, amplitude, rules.relief_wavelength, seed)


def heights_on_grid(land: Heights, x: FloatArray, y: FloatArray) -> FloatArray:
    """Heights at the places of a grid, len(y) x len(x)."""
    if isinstance(land, _Hills):
        return land.on_grid(x, y)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return land(points).reshape(len(y), len(x))


@dataclass(frozen=True)
class _Hills:
    """Hills on a plane; places on a grid are much faster than others."""

    trend: Heights
    amplitude: float
    wavelength: float
    seed: int

    def __call__(self, points: FloatArray) -> FloatArray:
        noise = smooth_noise(points, self.wavelength, self._draw())
        return self.trend(points) + self.amplitude * np.tanh(noise / RELIEF_PEAK)

    def on_grid(self, x: FloatArray, y: FloatArray) -> FloatArray:
        noise = smooth_noise_grid(x, y, self.wavelength, self._draw())
        return heights_on_grid(self.trend, x, y) + self.amplitude * np.tanh(noise / RELIEF_PEAK)

    def _draw(self) -> np.random.Generator:
        return generator(self.seed, "terrain", "relief")


def _trend(outline: Outline) -> Heights:
    """The plane through the outline, level along axes along which the road hardly spreads."""
    if not len(outline):
        return lambda points: np.zeros(len(points))
    points, _ = outline.samples(5.0)
    middle = points.mean(axis=0)
    offset = points - middle
    variance, axes = np.linalg.eigh(offset[:, :2].T @ offset[:, :2] / len(points))
    axes = axes[:, variance > TREND_SPREAD**2]
    slope = axes @ np.linalg.lstsq(offset[:, :2] @ axes, offset[:, 2], rcond=None)[0]
    return lambda points: middle[2] + (points[:, :2] - middle[:2]) @ slope


def _hint_of_hills(surface: RoadSurface) -> float:
    """Share of the relief that the windings of the roads outside junctions hint at."""
    roads = [line for line in surface.roads if not line.junction and len(line.s) > 1]
    length = sum(float(line.s[-1] - line.s[0]) for line in roads)
    turning = sum(float(np.abs(np.diff(np.unwrap(line.heading))).sum()) for line in roads)
    if not length:
        return 1.0
    winding = min(turning / length / (2 * WINDING), 1.0)
    return PLAIN + winding * (MOUNTAINS - PLAIN)
