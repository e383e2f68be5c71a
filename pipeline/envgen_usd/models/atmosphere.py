"""Sun, sky and air over a map, whatever program made them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.frozen_model import Model


@dataclass(frozen=True, repr=False, eq=False)
class Atmosphere(Model):
    """Light and air of a moment. World axes: x east, y north, z up.

    Attributes:
        sun_direction: 3, unit vector towards the sun.
        sun: 3, linear RGB, illuminance on a surface that faces the sun, behind the clouds.
        sky: H x 2 H x 3, linear RGB, luminance of the sky without the sun's disc. Rows go from the
            zenith to the nadir, columns as `sky_directions` gives them. In the unit of `sun` per
            steradian.
        visibility: Meteorological optical range in metres: contrast falls to 5 %.
        wetness: Share of the ground's surface that water covers, 0 to 1.
    """

    sun_direction: NDArray[np.float64]
    sun: NDArray[np.float64]
    sky: NDArray[np.float32]
    visibility: float
    wetness: float
