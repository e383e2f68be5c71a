"""Makes the atmosphere of a moment: clear sky, clouds, a closed layer, haze."""

import numpy as np

from envgen_usd.light.cloud_noise import cloud_noise, cloud_noise_at
from envgen_usd.light.daylight import (
    LUMINANCE,
    horizontal_illuminance,
    sky_luminance,
    sun_illuminance,
    tint,
)
from envgen_usd.light.sky_directions import sky_directions, solid_angles
from envgen_usd.light.weather import Moment
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import GROUND, Atmosphere, extinction_at

ROWS = 512
"""Rows of a sky map; a larger value gives sharper clouds."""
_SKY_AT_LEAST = 0.15
"""Least share of the clear sky in the illuminance of the ground."""
_CLOUD_SIZE = 1.6
"""Size of the largest clouds as a multiple of their height; a larger value gives larger clouds."""
_SOFT = 0.12
"""Share of the sky over which a cloud's edge fades; a larger value gives softer clouds."""
_WHITE = 0.75
"""Luminance of a cloud as a share of a white surface in the same light."""
_GLOW = 1.5
"""Additional luminance of clouds before the sun; a larger value gives brighter rims."""
_MOTTLED = 0.35
"""Contrast of a closed layer of clouds; a larger value shows more structure."""
_HORIZON_GLOW = 4.0
"""Additional glow of a town at the horizon over that at the zenith; a larger value concentrates it.

"""
_SODIUM = tint(0.44, 0.41)
"""Colour of the glow of warm street lamps, about 2900 K."""
_GREY = tint(0.310, 0.326)
"""Colour of a closed layer, slightly bluer than the sun above the atmosphere."""
_HAZE_HEIGHT = 400.0
"""Height of the hazy layer in metres; a larger value veils more of the sky."""
_EYE = 20.0
"""Height in metres from which the map shows the ground; a larger value gives a wider horizon."""


def make_atmosphere(
    moment: Moment, sun: FloatArray, rng: np.random.Generator, rows: int = ROWS
) -> Atmosphere:
    """Makes sun, sky and air.

    Args:
        moment: Air and clouds.
        sun: 3, unit vector towards the sun; may lie below the horizon.
        rng: Draws the clouds.
        rows: Rows of the sky map.

    Returns:
        The atmosphere, in klx and kcd/m².
    """
    above = sky_directions(rows)[: rows // 2]
    heights = above[:, 0, 2]
    clear, sunlight = _clear(above, sun, moment.turbidity)
    height = max(float(sun[2]), 0.0)
    total = float((_on_ground(clear) + sunlight * height)[1])
    sunlight = sunlight * moment.direct
    pattern = cloud_noise(above.reshape(-1, 3), _CLOUD_SIZE, rng).reshape(above.shape[:2])
    sky, hidden = _with_clouds(clear, (above, pattern), (sun, total), moment)
    closed = total * moment.light * 9.0 / (7.0 * np.pi) * _GREY
    mottled = 1.0 + _MOTTLED * (pattern - 0.5)
    # Moon and Spencer's overcast sky (1942), the CIE's: three times as bright at the zenith.
    layer = (1.0 + 2.0 * heights[:, None]) / 3.0 * mottled
    sky += moment.overcast * (closed[:, None, None] * layer - sky)
    sky += _town_glow(heights, moment)[..., None]
    sunlight = sunlight * (1.0 - moment.overcast) * (1.0 - hidden)
    clarity = _add_haze(sky, heights, float(max(sun[2], 0.02)), moment.visibility)
    sunlight = sunlight * clarity
    whole = np.empty((rows, 2 * rows, 3), np.float32)
    whole[: rows // 2] = np.moveaxis(sky, 0, -1)
    lit = _on_ground(sky) + sunlight * height
    whole[rows // 2 :] = _ground_below(sky[:, -1].T, lit, rows, moment.visibility)
    return Atmosphere(sun, sunlight, whole, moment.visibility, moment.wetness, rain=moment.rain)


def sun_behind_clouds(
    moment: Moment, sun: FloatArray, rng: np.random.Generator, rows: int = ROWS
) -> float:
    """Returns the share of the sun that the single clouds of `make_atmosphere` hide.

    Takes the same arguments, and a small part of the time.
    """
    if sun[2] <= 0.0:
        return 0.0
    above = sky_directions(rows)[: rows // 2].reshape(-1, 3)
    place = np.array([np.argmax(above @ sun)])
    return float(_opacity(cloud_noise_at(place, above, _CLOUD_SIZE, rng), moment)[0])


def _town_glow(heights: FloatArray, moment: Moment) -> FloatArray:
    """Returns the luminance of the night sky by the lamps of the town, 3 x H, kcd/m².

    Air and clouds scatter more of it towards the horizon. Clouds brighten the sky over towns about
    fivefold (C. Kyba et al., "Worldwide variations in artificial skyglow", 2015).
    """
    clouds = 1.0 + 4.0 * max(moment.overcast, 0.5 * moment.cover)
    pattern = 1.0 + _HORIZON_GLOW * (1.0 - heights) ** 3
    glow: FloatArray = moment.glow * 1e-6 * clouds * _SODIUM[:, None] * pattern
    return glow


def _ground_below(horizon: FloatArray, lit: FloatArray, rows: int, visibility: float) -> FloatArray:
    """Returns the lower half of a map: ground that fades into the haze of the horizon."""
    depth = -sky_directions(rows)[rows // 2 :, 0, 2]
    seen = np.exp(-extinction_at(visibility) * _EYE / depth)[:, None, None]
    ground = GROUND * lit / np.pi
    return seen * ground + (1.0 - seen) * horizon[None]


def _clear(above: FloatArray, sun: FloatArray, turbidity: float) -> tuple[FloatArray, FloatArray]:
    """Returns the sky's luminance (3 x H x W) and the sun's illuminance (3)."""
    elevation = float(np.degrees(np.arcsin(np.clip(sun[2], -1.0, 1.0))))
    parts = above[..., 0], above[..., 1], above[:, :1, 2]
    sky, sunlight = sky_luminance(parts, sun, turbidity), sun_illuminance(elevation, turbidity)
    expected = horizontal_illuminance(elevation)
    by_sun = float(sunlight[1]) * max(float(sun[2]), 0.0)
    wanted = max(expected - by_sun, _SKY_AT_LEAST * expected)
    sky *= wanted / max(float(_on_ground(sky)[1]), 1e-9)
    return sky, sunlight


def _on_ground(sky: FloatArray) -> FloatArray:
    """Returns the illuminance of open ground by the upper half of a sky, 3 x H x W."""
    rows = 2 * sky.shape[1]
    weight = sky_directions(rows)[: rows // 2, 0, 2] * solid_angles(rows)[: rows // 2, 0]
    light: FloatArray = sky.sum(axis=2) @ weight
    return light


def _with_clouds(
    clear: FloatArray,
    clouds: tuple[FloatArray, FloatArray],
    light: tuple[FloatArray, float],
    moment: Moment,
) -> tuple[FloatArray, float]:
    """Returns the sky (3 x H x W) with single clouds, and the share of the sun that they hide."""
    (above, pattern), (sun, total) = clouds, light
    edge = 1.0 - moment.cover
    opaque = _opacity(pattern, moment)
    thick = np.clip((pattern - edge) / max(moment.cover, 0.05), 0.0, 1.0)
    towards = above @ sun
    glow = np.maximum(towards, 0.0) ** 4
    white = _WHITE * total / np.pi * (1.0 + _GLOW * glow * glow * glow)
    shaded = white * (1.0 - 0.7 * moment.depth * thick)
    hides = opaque * 0.95
    sky = clear + hides * (shaded * _GREY[:, None, None] - clear)
    hidden = float(opaque.flat[int(np.argmax(towards))]) if sun[2] > 0.0 else 0.0
    return sky, hidden


def _opacity(pattern: FloatArray, moment: Moment) -> FloatArray:
    """Returns the opacity of single clouds where the noise has given values, N."""
    soft = (pattern - (1.0 - moment.cover)) / _SOFT + 0.5
    return np.clip(soft, 0.0, 1.0) * (moment.cover > 0.0)


def _add_haze(sky: FloatArray, heights: FloatArray, sun_height: float, visibility: float) -> float:
    """Puts a layer of haze before the sky (3 x H x W).

    Returns:
        Share of sunlight that passes it.
    """
    path = _HAZE_HEIGHT / np.maximum(heights, 0.01)
    veil = 1.0 - np.exp(-extinction_at(visibility) * path)
    weight = heights + 0.05
    mean = sky.mean(axis=2) @ weight / weight.sum()
    haze = 0.5 * (mean + mean @ LUMINANCE)
    sky += veil[:, None] * (haze[:, None, None] - sky)
    return float(np.exp(-extinction_at(visibility) * _HAZE_HEIGHT / sun_height))
