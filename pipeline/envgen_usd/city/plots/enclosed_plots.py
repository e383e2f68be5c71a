"""Plots with their house, or with a use, and the ways into them."""

from dataclasses import dataclass

import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.landuse import Plot

_NOWHERE = shapely.Polygon()


@dataclass(frozen=True)
class Gate:
    """A door at the street, or the gate of a garage.

    Attributes:
        place: Its centre, 2, metres.
        foot: Point on the frontage before it, 2, metres.
        width: Width, metres.
    """

    place: FloatArray
    foot: FloatArray
    width: float


@dataclass(frozen=True)
class Enclosed:
    """A plot with its house, or with a use.

    Attributes:
        plot: The plot.
        house: Outline of the house in plan; empty without any.
        gates: Doors and garages that ways lead to.
        is_use: True for a whole plot with a use; it always has an enclosure, a higher one.
        open_front: True for plots without enclosure towards streets.
        is_planted: False for plots whose garden is not generated.
        is_fenced: False for plots whose enclosure is not generated.
        beside_barriers: Land beside other enclosures, on which none is generated.
    """

    plot: Plot
    house: shapely.Polygon
    gates: tuple[Gate, ...]
    is_use: bool = False
    open_front: bool = False
    is_planted: bool = True
    is_fenced: bool = True
    beside_barriers: shapely.Geometry = _NOWHERE
