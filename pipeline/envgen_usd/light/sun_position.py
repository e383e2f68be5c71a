"""Position of the sun from latitude, date and hour."""

from datetime import date

import numpy as np

from envgen_usd.models.array_types import FloatArray


def sun_direction(latitude: float, day: date, hour: float) -> FloatArray:
    """Returns the unit vector towards the sun (x east, y north, z up).

    The declination follows J. W. Spencer, "Fourier series representation of the position of the
    sun" (Search 2(5), 1971); its error is below 0.04 degrees.

    Args:
        latitude: Degrees, north positive.
        day: Date.
        hour: Solar time: the sun is due south (or north) at 12.
    """
    turn = 2.0 * np.pi * (day.timetuple().tm_yday - 1) / 365.0
    declination = (
        0.006918
        - 0.399912 * np.cos(turn)
        + 0.070257 * np.sin(turn)
        - 0.006758 * np.cos(2 * turn)
        + 0.000907 * np.sin(2 * turn)
        - 0.002697 * np.cos(3 * turn)
        + 0.00148 * np.sin(3 * turn)
    )
    angle, place = np.radians(15.0 * (hour - 12.0)), np.radians(latitude)
    east = -np.cos(declination) * np.sin(angle)
    level, high = np.cos(declination) * np.cos(angle), np.sin(declination)
    north = high * np.cos(place) - level * np.sin(place)
    return np.array([east, north, high * np.sin(place) + level * np.cos(place)])
