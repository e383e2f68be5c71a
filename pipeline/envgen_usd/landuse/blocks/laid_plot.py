"""A plot that follows from its block rather than from a place along a street."""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.land_rules import Use
from envgen_usd.models.landuse import LanduseClass

WAY = 2.5
"""Width of the paved way into a plot, and its length inside of it, metres."""
_ONTO = 1.0
"""Length of a way on the road or lane that it leads from, metres."""
USES: dict[Use, LanduseClass] = {
    "park": LanduseClass.PARK,
    "parking": LanduseClass.PARKING,
    "allotment": LanduseClass.ALLOTMENT,
}


@dataclass(frozen=True)
class LaidPlot:
    """A plot with its way.

    Attributes:
        shape: Polygon, metres.
        landuse: Class of its ground.
        way: 4 x 2, paved way into it; or `None`.
    """

    shape: shapely.Polygon
    landuse: LanduseClass
    way: FloatArray | None = None


def way_into(front: FloatArray, before: float) -> FloatArray:
    """A way into land across the middle of one of its sides, 4 x 2.

    Args:
        front: 2 x 2, the side, in the direction of a counter-clockwise border.
        before: Distance from the side to the road or lane, metres.
    """
    along = front[1] - front[0]
    along /= np.linalg.norm(along)
    outwards = np.array([along[1], -along[0]])
    middle, half = front.mean(axis=0), along * WAY / 2.0
    street, inside = middle + outwards * (before + _ONTO), middle - outwards * WAY
    return np.stack([street - half, street + half, inside + half, inside - half])
