"""Daylight of a clear sky: luminance and colour of the sky, and of the sun through the air.

The model is that of A. J. Preetham, P. Shirley and B. Smits, "A practical analytic model for
daylight" (SIGGRAPH 1999). Below the horizon, twilight follows P. M. Janiczek and J. A. DeYoung,
"Computer programs for sun and moon illuminance" (U.S. Naval Observatory Circular 171, 1987).
Luminance is in kcd/m², illuminance in klx.
"""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Shares of linear red, green and blue in the luminance (sRGB)."""
_LOWEST = np.radians(2.0)
"""Least elevation of the sun in radians for which the sky's pattern is evaluated."""
_ABOVE_AIR = 133.0
"""Illuminance of the sun above the atmosphere, klx (Janiczek and DeYoung)."""
_BANDS = np.array([0.610, 0.550, 0.465])
"""Wavelengths in micrometres that stand for red, green and blue."""
_OZONE = np.array([0.120, 0.085, 0.010])
"""Absorption of ozone at these wavelengths, 1/cm."""
_OZONE_DEPTH = 0.35
"""Depth of the ozone layer, cm."""
_TO_SRGB = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)
"""From CIE XYZ to linear sRGB (IEC 61966-2-1)."""
_DISTRIBUTION = {
    "Y": ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771),
          (-0.0670, 0.3703)),
    "x": ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989),
          (-0.0033, 0.0452)),
    "y": ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537),
          (-0.0109, 0.0529)),
}  # fmt: skip
"""A to E of the Perez distribution as linear functions of the turbidity."""
_ZENITH = {
    "x": ((0.00166, -0.00375, 0.00209, 0.0), (-0.02903, 0.06377, -0.03202, 0.00394),
          (0.11693, -0.21196, 0.06052, 0.25886)),
    "y": ((0.00275, -0.00610, 0.00317, 0.0), (-0.04214, 0.08970, -0.04153, 0.00516),
          (0.15346, -0.26756, 0.06670, 0.26688)),
}  # fmt: skip
"""Chromaticity of the zenith: rows T², T, 1; columns cubic in the sun's zenith angle."""
_TWILIGHT = (
    (20.0, (3.74, 3.97, -4.07, 1.47)),
    (5.0, (3.05, 13.28, -45.98, 64.33)),
    (-0.8, (2.88, 22.26, -207.64, 1034.30)),
    (-5.0, (2.88, 21.81, -258.11, -858.36)),
    (-12.0, (2.70, 12.17, -431.69, -1899.83)),
    (-18.0, (13.84, 262.72, 1447.42, 2797.93)),
)
"""Cubics of log10(lux) in elevation / 90 degrees, from these elevations upwards."""
_DARKEST = 1e-6
"""Illuminance in klx below which the light of a moonless night does not fall."""


def horizontal_illuminance(elevation: float) -> float:
    """Returns the illuminance of level ground by sun and clear sky, klx, for any elevation.

    Args:
        elevation: Elevation of the sun, degrees.
    """
    x = elevation / 90.0
    for lowest, cubic in _TWILIGHT:
        if elevation >= lowest:
            return float(10.0 ** np.polyval(cubic[::-1], x) / 1000.0)
    return _DARKEST


def sun_illuminance(elevation: float, turbidity: float) -> FloatArray:
    """Returns the sun's illuminance on a surface that faces it, linear RGB, klx.

    Args:
        elevation: Elevation of the sun, degrees; below the horizon the result is 0.
        turbidity: Turbidity of the air, 2 (clear) to 10 (hazy).
    """
    if elevation <= 0.0:
        return np.zeros(3)
    # Kasten's optical air mass.
    mass = 1.0 / (np.sin(np.radians(elevation)) + 0.15 * (elevation + 3.885) ** -1.253)
    aerosol = 0.04608 * turbidity - 0.04586
    depth = 0.008735 * _BANDS**-4.08 + aerosol * _BANDS**-1.3 + _OZONE * _OZONE_DEPTH
    through: FloatArray = _ABOVE_AIR * np.exp(-depth * mass)
    return through


def sky_luminance(
    directions: Sequence[FloatArray], sun: FloatArray, turbidity: float
) -> FloatArray:
    """Returns the luminance of a clear sky, linear RGB, kcd/m²: 3 x ....

    Args:
        directions: x, y and z of unit vectors, arrays that broadcast; below the horizon the
            horizon's value is returned.
        sun: 3, unit vector towards the sun; may be below the horizon.
        turbidity: 2 to 10.
    """
    low = max(float(np.arcsin(np.clip(sun[2], -1.0, 1.0))), _LOWEST)
    flat = np.array([sun[0], sun[1], 0.0]) / max(float(np.hypot(sun[0], sun[1])), 1e-9)
    seen_sun = flat * np.cos(low) + np.array([0.0, 0.0, np.sin(low)])
    x, y, z = directions
    cosine = np.maximum(z, 0.01)
    towards = np.clip(x * seen_sun[0] + y * seen_sun[1] + z * seen_sun[2], -1.0, 1.0)
    apart = np.arccos(towards), towards
    zenith = np.pi / 2 - low
    powers = np.array([zenith**3, zenith**2, zenith, 1.0])
    turbid = np.array([turbidity**2, turbidity, 1.0])
    chi = (4.0 / 9.0 - turbidity / 120.0) * (np.pi - 2.0 * zenith)
    at_zenith = {
        "Y": (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192,
        **{name: float(turbid @ np.array(rows) @ powers) for name, rows in _ZENITH.items()},
    }
    value = {
        name: at_zenith[name]
        * _perez(name, turbidity, cosine, apart)
        / _perez(name, turbidity, np.ones(1), (np.full(1, zenith), np.cos([zenith])))
        for name in "Yxy"
    }
    rgb = _linear_srgb(value["x"], value["y"], np.maximum(value["Y"], 0.0))
    return np.maximum(rgb, 0.0, out=rgb)


def _perez(
    name: str, turbidity: float, cosine: FloatArray, apart: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Perez distribution; `apart` is the angle to the sun and its cosine."""
    a, b, c, d, e = (slope * turbidity + base for slope, base in _DISTRIBUTION[name])
    angle, towards = apart
    around = np.exp(d * angle)
    around *= c
    around += e * towards**2
    around += 1.0
    shape: FloatArray = (1.0 + a * np.exp(b / cosine)) * around
    return shape


def _linear_srgb(x: FloatArray, y: FloatArray, luminance: FloatArray) -> FloatArray:
    ratio = luminance / np.maximum(y, 1e-3)
    big_x, big_z = x * ratio, (1.0 - x - y) * ratio
    return np.stack([a * big_x + b * luminance + c * big_z for a, b, c in _TO_SRGB.tolist()])


def tint(x: float, y: float) -> FloatArray:
    """Returns the linear RGB of a chromaticity at luminance 1."""
    return _linear_srgb(np.array(x), np.array(y), np.array(1.0))
