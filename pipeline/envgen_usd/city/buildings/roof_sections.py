"""Roof cross-sections that are constant along the ridge."""

import math
from collections.abc import Callable
from typing import TypeAlias

Border: TypeAlias = list[tuple[float, float]]
"""Points in a vertical plane: horizontal coordinate and height, metres."""

_ARC_STEPS = 12
_TOOTH = 8.0
"""Largest width of a saw-tooth, metres; a larger value gives fewer teeth."""
_BREAK = 0.35
"""End of a mansard roof's lower slope, as a share of the half width."""
_STEEP = math.tan(math.radians(65.0))
"""Tangent of a mansard roof's lower slope."""


def level(width: float, eaves: float, _slope: float) -> Border:
    """A flat roof."""
    return [(0.0, eaves), (width, eaves)]


def shed(width: float, eaves: float, slope: float) -> Border:
    """A single slope that rises from the front to the back."""
    return [(0.0, eaves), (width, eaves + width * slope)]


def gabled(width: float, eaves: float, slope: float) -> Border:
    """Two slopes that meet in a ridge."""
    return [(0.0, eaves), (width / 2, eaves + width / 2 * slope), (width, eaves)]


def mansard(width: float, eaves: float, slope: float) -> Border:
    """A steep lower slope and a gentle upper one on each side."""
    run = min(_BREAK * width / 2, 1.5)
    bend = eaves + run * max(_STEEP, slope)
    ridge = bend + (width / 2 - run) * min(slope, 0.5)
    return [(0.0, eaves), (run, bend), (width / 2, ridge), (width - run, bend), (width, eaves)]


def barrel(width: float, eaves: float, slope: float) -> Border:
    """An arch; the slope is that at its springing line."""
    half = math.atan(max(slope, 0.2))
    radius = width / 2 / math.sin(half)
    angles = [half * (2 * step / _ARC_STEPS - 1) for step in range(_ARC_STEPS + 1)]
    drop = radius * math.cos(half)
    middle, centre = width / 2, eaves - drop
    inner = [(middle + radius * math.sin(a), centre + radius * math.cos(a)) for a in angles]
    return [(0.0, eaves), *inner[1:-1], (width, eaves)]


def sawtooth(width: float, eaves: float, slope: float) -> Border:
    """Slopes that each end in a vertical face, as on workshops with north lights."""
    count = max(2, math.ceil(width / _TOOTH))
    step = width / count
    rise = step * max(slope, 0.25)
    border: Border = [(0.0, eaves)]
    for tooth in range(count):
        end = (tooth + 1) * step if tooth < count - 1 else width
        border += [(end, eaves + rise), (end, eaves)]
    # The last face is a part of the back wall.
    return border[:-1]


SECTIONS: dict[str, Callable[[float, float, float], Border]] = {
    "flat": level,
    "shed": shed,
    "gabled": gabled,
    "mansard": mansard,
    "barrel": barrel,
    "sawtooth": sawtooth,
}
"""Functions of width, eaves height and slope, by roof kind."""
