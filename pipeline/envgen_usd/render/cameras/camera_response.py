"""What a camera makes of the light: exposure, lens, sensor, tone curve, compression.

1. The lens blurs, scatters a little light over the whole image, and darkens its corners.
2. The exposure follows the mean light of the image, with the error of an automatic exposure.
3. The sensor adds shot and read noise and saturates.
4. White balance, tone curve and saturation make the picture, JPEG compresses it.
"""

from dataclasses import dataclass, fields
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.special import ndtri

from envgen_usd.light.daylight import LUMINANCE
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray
from envgen_usd.render.render_scene import Floats

IDEAL, CAMERA = "ideal", "camera"
RESPONSES = (CAMERA, IDEAL)
"""Names of the option ``--response``."""
_GREY = 0.18
"""Linear level at which an exact exposure puts the metered mean."""
_BRIGHTEST = 4.0
"""Level, as a multiple of the median, at which metering ignores brighter parts of the image."""
_LOST = 0.08
"""Share of the lower half of the image that an exact exposure may saturate.

It holds by night, where a car in the low beam is much brighter than the rest of the street.
"""
_BASE_LIGHT = 0.26
"""Illuminance in klx of a white surface that saturates at ISO 100, f/2 and 1/30 s (ISO 2720)."""
_NOISE_GROWTH = 0.3
"""Exponent of the gain in the noise; photons alone would give one half."""
_BLUR_REACH = 3.0
"""Reach of the point spread in standard deviations; a larger value is exacter and slower."""
_FILM_EXPOSURE = 1.6
"""Exposure of the ideal response."""


@dataclass(frozen=True)
class CameraSettings:
    """A camera at a moment.

    Attributes:
        exposure_error: Error of the automatic exposure, stops; above 0 is too bright.
        sky_weight: Share of the upper half of the image in the metering, 0 to 1.
        gain: Largest gain of the sensor, stops above ISO 100; less makes dusk and night darker.
        blur: Standard deviation of the point spread, pixels.
        glare: Share of the light that the lens scatters over the image.
        vignetting: Loss of light in the corners, 0 to 1.
        warmth: Error of the white balance: gain of red over blue, stops.
        green: Error of the white balance: gain of green, stops.
        adaptation: Share of the light's colour that the white balance removes, 0 to 1.
        noise: Standard deviation of shot noise at middle grey, as a share of saturation.
        read_noise: Standard deviation of the sensor's noise in the dark, as a share of saturation.
        contrast: Steepness of the tone curve beyond the encoding of sRGB; 0 is none, and above 1
            the curve cuts off the darkest and the brightest levels.
        black: Level of the encoded picture that the camera shows as black, 0 to 1.
        saturation: Factor of the colours' distance from grey.
        sharpening: Strength of the camera's sharpening.
        quality: Quality of JPEG, 1 to 95; 0 keeps the picture as it is.
    """

    exposure_error: float
    sky_weight: float
    gain: float
    blur: float
    glare: float
    vignetting: float
    warmth: float
    green: float
    adaptation: float
    noise: float
    read_noise: float
    contrast: float
    black: float
    saturation: float
    sharpening: float
    quality: float


_LOW = CameraSettings(
    exposure_error=-1.2,
    sky_weight=0.0,
    gain=1.0,
    blur=0.3,
    glare=0.003,
    vignetting=0.05,
    warmth=-0.25,
    green=-0.08,
    adaptation=0.4,
    noise=0.002,
    read_noise=0.0008,
    contrast=0.7,
    black=0.0,
    saturation=0.3,
    sharpening=0.0,
    quality=70.0,
)
_HIGH = CameraSettings(
    exposure_error=1.6,
    sky_weight=0.3,
    gain=6.5,
    blur=0.9,
    glare=0.025,
    vignetting=0.35,
    warmth=0.25,
    green=0.08,
    adaptation=1.0,
    noise=0.008,
    read_noise=0.004,
    contrast=1.3,
    black=0.22,
    saturation=1.0,
    sharpening=0.8,
    quality=95.0,
)
"""Ranges that settings are drawn from, evenly."""


def draw_settings(rng: np.random.Generator) -> CameraSettings:
    """Draws the settings of a camera at a moment."""
    low = np.array([getattr(_LOW, field.name) for field in fields(CameraSettings)])
    high = np.array([getattr(_HIGH, field.name) for field in fields(CameraSettings)])
    # The sum of two even draws: moderate errors are the most likely.
    share = rng.random((2, len(low))).mean(axis=0)
    return CameraSettings(*(low + share * (high - low)).tolist())


def ideal_picture(radiance: Floats) -> ByteArray:
    """Develops linear RGB without lens or sensor.

    The film curve is that of K. Narkowicz, "ACES filmic tone mapping curve" (2016).

    Args:
        radiance: H x W x 3; a white surface on open ground has 1.

    Returns:
        H x W x 3, sRGB.
    """
    x = radiance * np.float32(_FILM_EXPOSURE)
    film = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
    return np.take(_quantised(_encoded(_LEVELS)), _steps(film.astype(np.float32)))


def camera_picture(
    radiance: Floats,
    settings: CameraSettings,
    rng: np.random.Generator,
    inside: BoolArray | None = None,
    white: float = 100.0,
) -> ByteArray:
    """Takes a picture of linear RGB.

    In the dark, the sensor's gain rises up to a limit, and its noise with it.

    Args:
        radiance: H x W x 3.
        settings: The camera.
        rng: Draws the noise.
        inside: H x W, True within the image circle of the lens; `None` for the whole image.
        white: Illuminance in klx of a white surface with a radiance of 1.

    Returns:
        H x W x 3, sRGB; the sensor's noise alone outside of the image circle.
    """
    # Planes of a colour are several times faster than pixels of three colours.
    image = np.ascontiguousarray(radiance.transpose(2, 0, 1), np.float32)
    image = _through_lens(image, settings, inside)
    wanted = _exposure(image, settings, inside) * 2.0**settings.exposure_error
    exposure = min(wanted, 2.0**settings.gain * white / _BASE_LIGHT)
    image *= np.float32(exposure)
    gain = max(exposure * _BASE_LIGHT / white, 1.0)
    image = _on_sensor(image, settings, gain, rng)
    image = _balanced(image, settings, inside)
    picture = np.ascontiguousarray(_toned(image, settings).transpose(1, 2, 0))
    return _compressed(picture, settings.quality)


def _through_lens(image: Floats, settings: CameraSettings, inside: BoolArray | None) -> Floats:
    """Blurs, scatters and darkens an image; 3 x H x W, as for all steps that follow."""
    # Light beyond saturation spreads like all other light, but not without limit.
    image = np.minimum(image, np.float32(60.0))
    reach = int(_BLUR_REACH * settings.blur + 0.5)
    bell = np.exp(-0.5 * (np.arange(reach + 1) / max(settings.blur, 1e-6)) ** 2)
    blurred = _smoothed(image, bell / (2.0 * bell.sum() - bell[0]))
    veil = _shown(image, inside).mean(axis=1) * np.float32(settings.glare)
    corner = np.float32(1.0 - settings.vignetting) ** _square_radius(image.shape[1:], inside)
    if inside is not None:
        corner = corner * inside
    blurred *= np.float32(1.0 - settings.glare)
    blurred += veil[:, None, None]
    blurred *= corner
    return blurred


def _smoothed(image: Floats, weights: FloatArray) -> Floats:
    """Convolves the rows and columns of planes with a symmetric kernel; borders are mirrored.

    Args:
        image: 3 x H x W.
        weights: Middle of the kernel and the weights to one side.
    """
    for axis in range(2):
        smooth = np.empty_like(image)
        for plane, into in zip(image, smooth, strict=True):
            _convolve(plane, into, weights, axis)
        image = smooth
    return image


def _convolve(plane: Floats, into: Floats, weights: FloatArray, axis: int) -> None:
    """Convolves a plane (H x W) along an axis into another one."""
    np.multiply(plane, np.float32(weights[0]), out=into)
    # A view with the smoothed axis first.
    to = into.swapaxes(0, axis)
    for offset, weight in enumerate(weights[1:].tolist(), 1):
        part = (plane * np.float32(weight)).swapaxes(0, axis)
        to[offset:] += part[:-offset]
        to[:-offset] += part[offset:]
        to[:offset] += part[:offset][::-1]
        to[-offset:] += part[-offset:][::-1]


def _shown(values: Floats, inside: BoolArray | None) -> Floats:
    """The pixels (3 x P) of an image within the image circle."""
    shown: Floats = values.reshape(3, -1) if inside is None else values[:, inside]
    return shown


def _luminance(image: Floats) -> Floats:
    red, green, blue = image
    weights = LUMINANCE.astype(np.float32)
    luminance: Floats = red * weights[0]
    luminance += green * weights[1]
    luminance += blue * weights[2]
    return luminance


def _square_radius(shape: tuple[int, int], inside: BoolArray | None) -> Floats:
    """Square of the distance from the image's centre; 1 in the corner, or on the image circle."""
    bounds = [(0, side - 1) for side in shape]
    if inside is not None:
        bounds = [(int(at.min()), int(at.max())) for at in np.nonzero(inside)]
    y, x = (
        np.arange(side, dtype=np.float32) - (low + high) / 2
        for side, (low, high) in zip(shape, bounds, strict=True)
    )
    square = (y[:, None] ** 2 + x[None, :] ** 2).astype(np.float32)
    farthest = square.max() if inside is None else square[inside].max()
    relative: Floats = square / farthest
    return relative


def _exposure(image: Floats, settings: CameraSettings, inside: BoolArray | None) -> float:
    """Factor that brings the metered mean to middle grey."""
    light = _luminance(image)
    lit = np.ones_like(light, bool) if inside is None else inside
    half = len(light) // 2
    below = light[half:][lit[half:]]
    brightest = float(np.quantile(below, 1.0 - _LOST)) if below.size else 0.0
    light = np.minimum(light, _BRIGHTEST * max(float(np.median(light[lit])), 1e-6))
    upper, lower = (
        float(light[rows][lit[rows]].mean()) if lit[rows].any() else float(light[lit].mean())
        for rows in (slice(half), slice(half, None))
    )
    metered = settings.sky_weight * upper + (1.0 - settings.sky_weight) * lower
    return min(_GREY / max(metered, 1e-6), 1.0 / max(brightest, 1e-6))


def _on_sensor(
    image: Floats, settings: CameraSettings, gain: float, rng: np.random.Generator
) -> Floats:
    """Adds noise and saturates; cameras smooth away a part of the noise of a high gain."""
    draws = np.take(_NORMAL, rng.integers(0, len(_NORMAL), image.shape, dtype=np.uint16))
    more = gain**_NOISE_GROWTH
    variance = np.maximum(image, np.float32(0.0))
    variance *= np.float32((more * settings.noise) ** 2 / _GREY)
    variance += np.float32((more * settings.read_noise) ** 2)
    draws *= np.sqrt(variance, out=variance)
    draws += image
    return np.minimum(draws, np.float32(1.0), out=draws)


def _balanced(image: Floats, settings: CameraSettings, inside: BoolArray | None) -> Floats:
    """Removes a share of the mean colour (grey world), adds the camera's error, desaturates."""
    mean = np.maximum(_shown(image, inside).mean(axis=1), 1e-4)
    gains = (float(mean @ LUMINANCE) / mean) ** settings.adaptation
    gains = np.clip(gains, 0.5, 2.0)
    gains *= 2.0 ** np.array([settings.warmth / 2, settings.green, -settings.warmth / 2])
    gains = gains.astype(np.float32)[:, None]
    # Saturated pixels stay white.
    peak = np.maximum(np.maximum(image[0], image[1]), image[2])
    bright = np.flatnonzero(peak > 0.9)
    pixels = image.reshape(3, -1)
    held = np.clip((peak.reshape(-1)[bright] - 0.9) / 0.1, 0.0, 1.0)
    kept = pixels[:, bright] * (gains * (1.0 - held) + held)
    pixels *= gains
    pixels[:, bright] = kept
    grey = _luminance(image)
    image -= grey
    image *= np.float32(settings.saturation)
    image += grey
    return image


def _toned(image: Floats, settings: CameraSettings) -> ByteArray:
    """Encodes, sharpens, and applies contrast and black level."""
    encoded = np.take(_encoded(_LEVELS), _steps(image))
    if settings.sharpening > 0.0:
        soft = _smoothed(encoded, np.array([1.0, 1.0]) / 3.0)
        soft *= np.float32(-settings.sharpening)
        encoded *= np.float32(1.0 + settings.sharpening)
        encoded += soft
    steep = _LEVELS * _LEVELS * (np.float32(3.0) - np.float32(2.0) * _LEVELS)
    toned = _LEVELS + np.float32(settings.contrast) * (steep - _LEVELS)
    black = np.float32(settings.black)
    above: Floats = (toned - black) / (np.float32(1.0) - black)
    return np.take(_quantised(above), _steps(encoded))


_LEVELS = np.linspace(0.0, 1.0, 1 << 16, dtype=np.float32)
"""Levels at which curves are tabled; the encoding of sRGB is then exact to 0.03 of a grey value."""


_NORMAL = ndtri((np.arange(1 << 16) + 0.5) / (1 << 16)).astype(np.float32)
"""Quantiles of the normal distribution: to draw one takes a third of the time of a normal draw."""


def _steps(levels: Floats) -> NDArray[np.uint16]:
    """Indices into `_LEVELS`; levels beyond 0 and 1 are clipped."""
    clipped = np.clip(levels, np.float32(0.0), np.float32(1.0))
    clipped *= np.float32(len(_LEVELS) - 1)
    clipped += np.float32(0.5)
    return clipped.astype(np.uint16)


def _encoded(linear: Floats) -> Floats:
    """The transfer function of sRGB (IEC 61966-2-1)."""
    dark = linear * np.float32(12.92)
    bright = np.float32(1.055) * np.power(np.maximum(linear, 0.0), np.float32(1 / 2.4))
    encoded: Floats = np.where(linear <= 0.0031308, dark, bright - np.float32(0.055))
    return encoded


def _quantised(encoded: Floats) -> ByteArray:
    picture: ByteArray = np.round(np.clip(encoded, 0.0, 1.0) * 255.0).astype(np.uint8)
    return picture


def _compressed(picture: ByteArray, quality: float) -> ByteArray:
    if quality < 1.0:
        return picture
    with BytesIO() as file:
        Image.fromarray(picture).save(file, "jpeg", quality=round(quality))
        return np.asarray(Image.open(file))
