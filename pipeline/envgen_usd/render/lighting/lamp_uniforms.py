"""The lamps that light a view."""

from collections.abc import Mapping

import numpy as np

from envgen_usd.light.daylight import LUMINANCE
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Lamps

MOST = 32
"""Lamps of a view; a larger value lights more distant streets and is slower."""
_AHEAD = 30.0
"""Distance in metres before the camera of the point whose nearest lamps are chosen."""
_FAINT = 0.01
"""Share of the open ground's light at `_NEAR` below which lamps are not drawn."""
_NEAR = 5.0
"""Distance in metres at which a lamp is compared with the open ground's light."""


def lamp_uniforms(
    lamps: Lamps, eye: FloatArray, ahead: FloatArray, unit: float
) -> Mapping[str, int | FloatArray]:
    """Returns the uniforms of `lamps.glsl` for the lamps near the camera.

    Args:
        lamps: All lamps of the scene.
        eye: 3, world, metres.
        ahead: 3, unit vector of the view.
        unit: Illuminance by a lamp of intensity 1 on the stage; white open ground has pi.
    """
    strength = lamps.powers @ LUMINANCE * unit / np.pi
    if not len(strength) or strength.max() < _FAINT * _NEAR**2:
        return {"lamp_count": 0}
    away = np.linalg.norm(lamps.places - (eye + _AHEAD * ahead), axis=1)
    chosen = np.argsort(away, kind="stable")[:MOST]

    def filled(rows: FloatArray) -> FloatArray:
        whole = np.zeros((MOST, 3))
        whole[: len(chosen)] = rows
        return whole

    beams = np.stack([lamps.flat, lamps.edges, np.zeros(len(lamps.edges))], axis=1)
    return {
        "lamp_count": len(chosen),
        "lamp_places": filled(lamps.places[chosen] - eye),
        "lamp_powers": filled(lamps.powers[chosen] * unit / np.pi),
        "lamp_axes": filled(lamps.axes[chosen]),
        "lamp_beams": filled(beams[chosen]),
    }
