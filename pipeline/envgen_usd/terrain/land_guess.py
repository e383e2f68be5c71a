"""Estimates the land without the road: a trend plane through the road, and seeded hills."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.geometry.smooth_noise import smooth_noise, smooth_noise_grid
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

TREND_SPREAD = 25.0
"""Least standard deviation in metres of the road along an axis for a slope along that axis. The
cross-fall of a single road carries no information about the land."""
RELIEF_PEAK = 1.25
"""Standard deviations of the noise that correspond to three quarters of the relief's amplitude."""
PLAIN, MOUNTAINS = 0.5, 1.5
"""Factors of the relief beside the straightest and the most winding roads."""
WINDING = 4e-3
"""Radians of turning per metre for a factor halfway between plain and mountains; a larger value
lowers the hills."""


def guess_land(surface: RoadSurface, rules: TerrainRules, seed: int) -> Heights:
    """Returns the plane through the road plus hills, which are higher beside winding roads.

    Args:
        surface: Road.
        rules: Amplitude and wavelength of the hills.
        seed: The user's seed.
    """
    points, _ = Outline.of(surface).samples(5.0)
    return land_through(points, _winding(surface), rules, seed)


def land_through(
    points: FloatArray, winding: float | None, rules: TerrainRules, seed: int
) -> Heights:
    """Returns the plane through points of the road, plus hills.

    Args:
        points: N x 3, metres, at equal distances along the roads.
        winding: Turning of the roads, radians per metre; `None` if nothing is known.
        rules: Amplitude and wavelength of the hills.
        seed: The user's seed.
    """
    trend = _trend(points)
    if not rules.relief:
        return trend
    share = min((WINDING if winding is None else winding) / (2 * WINDING), 1.0)
    amplitude = rules.relief * (PLAIN + share * (MOUNTAINS - PLAIN))
    return _Hills(trend, amplitude, rules.relief_wavelength, seed)


def heights_on_grid(land: Heights, x: FloatArray, y: FloatArray) -> FloatArray:
    """Evaluates heights on a grid, len(y) x len(x), metres."""
    if isinstance(land, _Hills):
        return land.on_grid(x, y)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return land(points).reshape(len(y), len(x))


@dataclass(frozen=True)
class _Hills:
    """Hills on a plane; a grid is evaluated much faster than scattered points."""

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


@dataclass(frozen=True)
class _Plane:
    """A plane: the height of a point, and the slopes along x and y."""

    middle: FloatArray
    slope: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        heights: FloatArray = self.middle[2] + (points[:, :2] - self.middle[:2]) @ self.slope
        return heights


def _trend(points: FloatArray) -> Heights:
    """Returns the plane through points, level along axes with little spread of the road."""
    if not len(points):
        return _Plane(np.zeros(3), np.zeros(2))
    middle = points.mean(axis=0)
    offset = points - middle
    variance, axes = np.linalg.eigh(offset[:, :2].T @ offset[:, :2] / len(points))
    axes = axes[:, variance > TREND_SPREAD**2]
    slope = axes @ np.linalg.lstsq(offset[:, :2] @ axes, offset[:, 2], rcond=None)[0]
    return _Plane(middle, slope)


def _winding(surface: RoadSurface) -> float | None:
    """Returns the turning of the roads outside junctions, radians per metre; `None` without any."""
    roads = [line for line in surface.roads if not line.junction and len(line.s) > 1]
    length = sum(float(line.s[-1] - line.s[0]) for line in roads)
    turning = sum(float(np.abs(np.diff(np.unwrap(line.heading))).sum()) for line in roads)
    return turning / length if length else None
