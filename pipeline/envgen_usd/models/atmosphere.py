"""Sun, sky and air over a map, whatever program made them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.frozen_model import Model

GROUND = 0.16
"""Reflectance of the ground and of the walls around a place; a larger value lights shadows more."""
STAGE_UNIT = 20.0
"""Illuminance in klx of a light of intensity 1 on a stage; a sunny day then is near 5."""
_CONTRAST = 3.912
"""Extinction times visibility: the logarithm of 50."""


@dataclass(frozen=True, repr=False, eq=False)
class Atmosphere(Model):
    """Light and air of a moment. World axes: x east, y north, z up.

    Attributes:
        sun_direction: 3, unit vector towards the sun.
        sun: 3, linear RGB, illuminance on a surface that faces the sun, behind the clouds.
        sky: H x 2 H x 3, linear RGB, luminance of the sky without the sun's disc. Rows go from the
            zenith to the nadir, columns as `sky_directions` gives them. In the unit of `sun` per
            steradian.
        visibility: Metres at which the contrast to the horizon falls to 2 % (Koschmieder).
        wetness: Share of the ground's surface that water covers, 0 to 1.
        lamp_unit: Illuminance, in the unit of `sun`, of a lamp of intensity 1 on the stage.
        rain: Rate of rain, mm/h.
    """

    sun_direction: NDArray[np.float64]
    sun: NDArray[np.float64]
    sky: NDArray[np.float32]
    visibility: float
    wetness: float
    lamp_unit: float = STAGE_UNIT
    rain: float = 0.0

    @property
    def extinction(self) -> float:
        """Extinction of the air, 1/m."""
        return extinction_at(self.visibility)


def extinction_at(visibility: float) -> float:
    """Returns the extinction of air (1/m) with a visibility in metres."""
    return _CONTRAST / visibility
