"""From what the hOffset of a file's signals is counted.

The standard counts it from the direction of the traffic that a signal holds for (14.1). Some
exporters count it from the reference line, and some give the direction in which the face looks.
A file does the same everywhere, and a sign that looks away from its traffic helps nobody: the
reading under which most signals look at theirs is the right one.
"""

import math
from collections.abc import Iterable
from typing import TypeAlias

from envgen_usd.models.road import Road
from envgen_usd.models.signals import Signal

Facing: TypeAlias = dict[str, float]
"""Angle from the reference line to the face at hOffset 0, radians, by orientation."""
FROM_TRAFFIC: Facing = {"+": math.pi, "-": 0.0, "none": math.pi}
"""As in the standard."""
FROM_LINE: Facing = {"+": math.pi, "-": math.pi, "none": math.pi}
OF_FACE: Facing = {"+": 0.0, "-": 0.0, "none": 0.0}


def facing_of(roads: Iterable[Road]) -> Facing:
    """How the signals of a file are meant; as in the standard where there is a doubt."""
    signals = [
        signal
        for road in roads
        for signal in road.signals
        if not signal.reference and signal.position is None and signal.orientation in {"+", "-"}
    ]
    return max((FROM_TRAFFIC, FROM_LINE, OF_FACE), key=lambda facing: _fit(facing, signals))


def face_angle(facing: Facing, signal: Signal) -> float:
    """Angle from the reference line to the direction in which a signal looks, radians."""
    return facing.get(signal.orientation, facing["none"]) + signal.heading


def _fit(facing: Facing, signals: list[Signal]) -> float:
    """Sum of the cosines between where the signals look and where their traffic comes from."""
    fit = sum(
        math.cos(face_angle(facing, signal) - FROM_TRAFFIC[signal.orientation])
        for signal in signals
    )
    return round(fit, 6)
