"""The form of a car's body: profile, plan and cross-section as curves.

The lower body is a stack of plan outlines from sill to shoulder, closed by bonnet and deck.
The cabin is a stack of outlines from the belt to the edge of the roof, closed by the roof.
Lengths are metres; ``along`` is the distance from the foremost point of the car.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from envgen_usd.models.array_types import FloatArray

Curve = tuple[tuple[float, float], ...]
"""Points (position, value) of a smooth curve; beyond its ends the end values hold."""


def curve(points: Curve, at: FloatArray | float) -> FloatArray:
    """Values of a monotone piecewise cubic curve (Fritsch and Carlson 1980)."""
    position, value = np.array(points).T
    inside = np.clip(at, position[0], position[-1])
    values: FloatArray = PchipInterpolator(position, value)(inside)
    return values


@dataclass(frozen=True)
class Outline:
    """Half a plan outline with rounded ends.

    Attributes:
        front: Foremost point, along.
        rear: Rearmost point, along.
        half: Half the width.
        nose: Length of the rounded front end.
        tail: Length of the rounded rear end.
        square: Exponents of both ends' superellipses; larger values are squarer.
    """

    front: float
    rear: float
    half: float
    nose: float
    tail: float
    square: tuple[float, float] = (2.6, 3.0)


@dataclass(frozen=True)
class Cabin:
    """The greenhouse: windscreen, side windows, rear window and roof.

    Attributes:
        base: Outline at the height of the belt.
        top: Outline at the edge of the roof.
        foot: Height of the base, below all of the belt.
        roof: Height of the edge of the roof, by along.
        crown: Rise of the roof from its edge to its middle line.
        bulge: Outward bend of the side windows half way up.
    """

    base: Outline
    top: Outline
    foot: float
    roof: Curve
    crown: float = 0.06
    bulge: float = 0.018


_BOW: Curve = ((0.0, 0.10), (0.2, 0.03), (0.42, 0.0), (0.66, 0.02), (0.85, 0.07), (1.0, 0.15))
_STERN: Curve = ((0.0, 0.12), (0.2, 0.03), (0.45, 0.0), (0.75, 0.02), (1.0, 0.06))
_FLANK: Curve = (
    (0.0, 0.085), (0.12, 0.048), (0.28, 0.014), (0.45, 0.024), (0.66, 0.011), (0.75, 0.0),
    (0.80, 0.008), (0.92, 0.036), (1.0, 0.078),
)  # fmt: skip
"""A bulge above the sill, a hollow, and an edge below the windows."""


@dataclass(frozen=True)
class CarForm:
    """A body.

    Attributes:
        length: Overall length.
        width: Overall width without mirrors.
        axles: Along of the axles, front to rear.
        wheel: Radius of the wheels.
        tyre: Width of the tyres.
        sill: Height of the lower edge of the flanks.
        shoulder: Height of the upper edge of the flanks, by along.
        cabin: The greenhouse.
        bonnet: Rise of bonnet and deck from the shoulder to the middle line, by along.
        bow: Retreat of the front, by the share of the height from sill to shoulder.
        stern: Retreat of the rear, likewise.
        flank: Retreat of the flanks, likewise.
        nose: Length of the rounded front end of the plan.
        tail: Length of the rounded rear end of the plan.
        square: Exponents of both ends, see `Outline`.
        arch: Gap between tyre and wheel arch; below 0, skirts hide the wheels and have no arch.
        flare: Bulge of the wings around the arches.
    """

    length: float
    width: float
    axles: tuple[float, ...]
    wheel: float
    tyre: float
    sill: float
    shoulder: Curve
    cabin: Cabin
    bonnet: Curve = ((0.0, 0.03), (0.6, 0.05), (1.2, 0.06))
    bow: Curve = field(default=_BOW)
    stern: Curve = field(default=_STERN)
    flank: Curve = field(default=_FLANK)
    nose: float = 0.80
    tail: float = 0.55
    square: tuple[float, float] = (2.5, 3.2)
    arch: float = 0.045
    flare: float = 0.014

    def x(self, along: FloatArray | float) -> FloatArray:
        """X by along: the origin is in the middle of the length."""
        return np.asarray(self.length / 2 - np.asarray(along))


@dataclass(frozen=True)
class Detail:
    """How finely a body is drawn.

    Attributes:
        front: Columns around the front.
        side: Columns along the side.
        rear: Columns around the rear.
        flank: Shares of the height of the lower body at which rings lie.
        lid: Shares of the way from the edge to the middle line of bonnet, deck and roof.
        cabin: Shares of the height of the cabin.
        cabin_side: Columns along the side of the cabin.
    """

    front: int
    side: int
    rear: int
    flank: tuple[float, ...]
    lid: tuple[float, ...]
    cabin: tuple[float, ...]
    cabin_side: int


NEAR = Detail(
    8, 13, 7,
    (0.0, 0.12, 0.28, 0.48, 0.75, 0.80, 0.92, 1.0),
    (0.0, 0.06, 0.45, 1.0),
    (0.0, 0.35, 0.7, 0.94, 1.0),
    8,
)  # fmt: skip
FAR = Detail(3, 2, 3, (0.0, 0.78, 1.0), (0.0, 1.0), (0.0, 1.0), 2)


def half_outline(outline: Outline, switch: tuple[float, float], count: tuple[int, int, int]
                 ) -> FloatArray:  # fmt: skip
    """Points (along, y) of half an outline from the front's middle to the rear's.

    Args:
        outline: The outline.
        switch: Along where the front end's columns stop and the rear end's begin; columns between
            have the same along on all outlines with the same switch.
        count: Columns of the front end, the side and the rear end.
    """
    front = _end(outline, switch[0], count[0], rear=False)
    rear = _end(outline, switch[1], count[2], rear=True)[::-1]
    along = np.linspace(switch[0], switch[1], count[1] + 1)[1:-1]
    side = np.stack([along, _half_width(outline, along)], axis=1)
    return np.concatenate([front, side, rear])


def _half_width(outline: Outline, along: FloatArray) -> FloatArray:
    """Half the width of an outline at along."""
    at_nose = np.clip((outline.front + outline.nose - along) / outline.nose, 0.0, 1.0)
    at_tail = np.clip((along - outline.rear + outline.tail) / outline.tail, 0.0, 1.0)
    n, m = outline.square
    half: FloatArray = outline.half * (1 - at_nose**n) ** (1 / n) * (1 - at_tail**m) ** (1 / m)
    return half


def _end(outline: Outline, switch: float, count: int, *, rear: bool) -> FloatArray:
    """An end of an outline from its tip to the switch, at equal distances."""
    tip = outline.rear if rear else outline.front
    straight = outline.rear - outline.tail if rear else outline.front + outline.nose
    n, half = outline.square[int(rear)], outline.half
    angle = np.linspace(0.0, np.pi / 2, 200)
    along = straight + (tip - straight) * np.cos(angle) ** (2 / n)
    y = half * np.sin(angle) ** (2 / n)
    if (switch - straight) * (straight - tip) > 0:
        along, y = np.append(along, switch), np.append(y, half)
    else:
        end = (along - switch) * np.sign(straight - tip) <= 0
        y_end = float(np.interp(0.0, (along - switch) * np.sign(straight - tip), y))
        along, y = np.append(along[end], switch), np.append(y[end], y_end)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(along), np.diff(y)))])
    at = np.linspace(0.0, way[-1], count)
    return np.stack([np.interp(at, way, along), np.interp(at, way, y)], axis=1)
