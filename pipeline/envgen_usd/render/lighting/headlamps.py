"""The low beam of the vehicle that carries the cameras."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import STAGE_UNIT

MOST = 2
"""Largest number of headlamps of a vehicle; the array of `lamps.glsl` is as long."""
DARK = 1.0
"""Illuminance in klx below which headlamps are switched on (UN Regulation 48, 6.2.7.6.2)."""
_COLOUR = np.array((1.18, 0.97, 0.78))
"""Linear RGB of a lamp of about 4300 K at luminance 1."""


@dataclass(frozen=True)
class Headlamps:
    """Headlamps of a vehicle in a frame.

    Attributes:
        places: N x 3, metres, world; N is at most `MOST`.
        ahead: 3, unit vector ahead of the vehicle, world.
    """

    places: FloatArray
    ahead: FloatArray


def headlamps_at(places: FloatArray, vehicle: FloatArray) -> Headlamps:
    """Places headlamps in the world.

    Args:
        places: N x 3, in the vehicle frame, metres.
        vehicle: 4 x 4, from the vehicle frame to the world.
    """
    return Headlamps(places @ vehicle[:3, :3].T + vehicle[:3, 3], vehicle[:3, 0])


def headlamp_uniforms(
    headlamps: Headlamps | None, eye: FloatArray, unit: float, white: float
) -> Mapping[str, int | FloatArray]:
    """Returns the uniforms of `lamps.glsl` for the headlamps.

    Args:
        headlamps: Headlamps, or `None`.
        eye: 3, world, metres.
        unit: Illuminance by a lamp of intensity 1 on the stage; white open ground has pi.
        white: Illuminance of open ground, klx.
    """
    if headlamps is None or white >= DARK or not len(headlamps.places):
        return {"headlamp_count": 0}
    places = np.zeros((MOST, 3))
    places[: len(headlamps.places)] = headlamps.places - eye
    return {
        "headlamp_count": len(headlamps.places),
        "headlamp_places": places,
        "headlamp_ahead": headlamps.ahead,
        "headlamp_power": _COLOUR * unit / STAGE_UNIT / np.pi,
    }
