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
from envgen_usd.light.sky_directions import ground_illuminance, sky_directions
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
    directions = sky_directions(rows)
    above = directions[: rows // 2].reshape(-1, 3)
    clear, sunlight = _clear(above, sun, moment.turbidity)
    height = max(float(sun[2]), 0.0)
    total = float((ground_illuminance(_whole(clear)) + sunlight * height)[1])
    sunlight = sunlight * moment.direct
    pattern = cloud_noise(above, _CLOUD_SIZE, rng)
    sky, hidden = _with_clouds(clear, (above, pattern), (sun, total), moment)
    closed = total * moment.light * 9.0 / (7.0 * np.pi) * _GREY
    mottled = 1.0 + _MOTTLED * (pattern - 0.5)
    # Moon and Spencer's overcast sky (1942), the CIE's: three times as bright at the zenith.
    layer = closed * ((1.0 + 2.0 * above[:, 2]) / 3.0 * mottled)[:, None]
    sky += moment.overcast * (layer - sky)
    sky += _town_glow(above[:, 2], moment)
    sunlight = sunlight * (1.0 - moment.overcast) * (1.0 - hidden)
    sky, clarity = _with_haze(sky, above[:, 2], float(max(sun[2], 0.02)), moment.visibility)
    whole = _whole(sky)
    sunlight = sunlight * clarity
    lit = ground_illuminance(whole) + sunlight * height
    whole[rows // 2 :] = _ground_below(whole[rows // 2 - 1], lit, rows, moment.visibility)
    return Atmosphere(
        sun, sunlight, whole.astype(np.float32), moment.visibility, moment.wetness, rain=moment.rain
    )


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


def _town_glow(height: FloatArray, moment: Moment) -> FloatArray:
    """Returns the luminance of the night sky by the lamps of the town, N x 3, kcd/m².

    Air and clouds scatter more of it towards the horizon. Clouds brighten the sky over towns about
    fivefold (C. Kyba et al., "Worldwide variations in artificial skyglow", 2015).
    """
    clouds = 1.0 + 4.0 * max(moment.overcast, 0.5 * moment.cover)
    pattern = (1.0 + _HORIZON_GLOW * (1.0 - height) ** 3)[:, None]
    glow: FloatArray = moment.glow * 1e-6 * clouds * pattern * _SODIUM
    return glow


def _ground_below(horizon: FloatArray, lit: FloatArray, rows: int, visibility: float) -> FloatArray:
    """Returns the lower half of a map: ground that fades into the haze of the horizon."""
    depth = -sky_directions(rows)[rows // 2 :, 0, 2]
    seen = np.exp(-extinction_at(visibility) * _EYE / depth)[:, None, None]
    ground = GROUND * lit / np.pi
    return seen * ground + (1.0 - seen) * horizon[None]


def _clear(above: FloatArray, sun: FloatArray, turbidity: float) -> tuple[FloatArray, FloatArray]:
    """Returns the sky's luminance (N x 3) and the sun's illuminance (3)."""
    elevation = float(np.degrees(np.arcsin(np.clip(sun[2], -1.0, 1.0))))
    sky, sunlight = sky_luminance(above, sun, turbidity), sun_illuminance(elevation, turbidity)
    expected = horizontal_illuminance(elevation)
    by_sun = float(sunlight[1]) * max(float(sun[2]), 0.0)
    wanted = max(expected - by_sun, _SKY_AT_LEAST * expected)
    return sky * (wanted / max(float(ground_illuminance(_whole(sky))[1]), 1e-9)), sunlight


def _whole(upper: FloatArray) -> FloatArray:
    """Returns a sky map (H x 2 H x 3) from its upper half (H² x 3), black below the horizon."""
    rows = round(np.sqrt(len(upper)))
    whole = np.zeros((rows, 2 * rows, 3))
    whole[: rows // 2] = upper.reshape(rows // 2, 2 * rows, 3)
    return whole


def _with_clouds(
    clear: FloatArray,
    clouds: tuple[FloatArray, FloatArray],
    light: tuple[FloatArray, float],
    moment: Moment,
) -> tuple[FloatArray, float]:
    """Returns the sky with single clouds, and the share of the sun that they hide."""
    (above, pattern), (sun, total) = clouds, light
    edge = 1.0 - moment.cover
    opaque = _opacity(pattern, moment)
    thick = np.clip((pattern - edge) / max(moment.cover, 0.05), 0.0, 1.0)
    towards = np.maximum(above @ sun, 0.0)
    white = _WHITE * total / np.pi * (1.0 + _GLOW * towards**12)
    shaded = white * (1.0 - 0.7 * moment.depth * thick)
    sky = clear + (opaque * 0.95)[:, None] * (shaded[:, None] * _GREY - clear)
    hidden = float(opaque[int(np.argmax(above @ sun))]) if sun[2] > 0.0 else 0.0
    return sky, hidden


def _opacity(pattern: FloatArray, moment: Moment) -> FloatArray:
    """Returns the opacity of single clouds where the noise has given values, N."""
    soft = (pattern - (1.0 - moment.cover)) / _SOFT + 0.5
    return np.clip(soft, 0.0, 1.0) * (moment.cover > 0.0)


def _with_haze(
    sky: FloatArray, height: FloatArray, sun_height: float, visibility: float
) -> tuple[FloatArray, float]:
    """Returns the sky behind a layer of haze, and the share of sunlight that passes it."""
    path = _HAZE_HEIGHT / np.maximum(height, 0.01)
    veil = 1.0 - np.exp(-extinction_at(visibility) * path)
    weight = height + 0.05
    mean = (sky * weight[:, None]).sum(axis=0) / weight.sum()
    grey = np.full(3, mean @ LUMINANCE)
    haze = 0.5 * (mean + grey)
    clarity = float(np.exp(-extinction_at(visibility) * _HAZE_HEIGHT / sun_height))
    return sky + veil[:, None] * (haze - sky), clarity
