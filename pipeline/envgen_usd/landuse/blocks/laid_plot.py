"""A plot that follows from its block rather than from a place along a street."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.distribution import Range
from envgen_usd.models.land_rules import Use
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.seeds import Draws

WAY = 2.5
"""Width of the paved way into a plot, and its length inside of it, metres."""
_ONTO = 1.0
"""Length of a way on the road or lane that it leads from, metres."""
AREAS: Mapping[Use, Range] = {
    "park": (120.0, np.inf),
    "parking": (120.0, 2500.0),
    "allotment": (150.0, np.inf),
    "garages": (250.0, 1600.0),
    "shop": (800.0, 2500.0),
    "school": (1000.0, 10000.0),
}
"""Range of the area of a whole plot with each use, m²; a wider one mixes uses more."""
AT_STREET: frozenset[Use] = frozenset(("shop",))
"""Uses that need a street, and lie at no lane inside of a block."""
LEAST_USE = min(least for least, _ in AREAS.values())
"""Least area of a whole plot with a use, m²; smaller land goes to neighbours."""


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


def drawn_use(
    weights: Mapping[Use, float], area: float, name: str, draws: Draws, *, at_street: bool = True
) -> LanduseClass:
    """The class of a whole plot with a use that suits its size and place; any where none does.

    Args:
        weights: Weights of uses.
        area: Area of the plot, m².
        name: Name of the draw.
        draws: Random numbers of the land.
        at_street: False for plots at a lane inside of a block.
    """
    possible = {
        use: weight
        for use, weight in weights.items()
        if AREAS[use][0] <= area <= AREAS[use][1] and (at_street or use not in AT_STREET)
    }
    return LanduseClass[draws.choice(name, possible or weights).upper()]
