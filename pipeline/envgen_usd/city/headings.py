"""Headings of what stands in a city."""

import numpy as np

from envgen_usd.models.array_types import FloatArray

_DIGITS = 6
_HALF_TURN = 3.141592
"""Largest heading of six digits."""


def heading_of(direction: FloatArray) -> float:
    """Returns the heading of a direction (2) in radians, rounded as files hold it.

    Half a turn is rounded down: above pi, it would be read back as a turn to the other side.
    """
    heading = round(float(np.arctan2(direction[1], direction[0])), _DIGITS)
    return float(np.clip(heading, -_HALF_TURN, _HALF_TURN))
