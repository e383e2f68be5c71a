"""Determines the reference direction of hOffset in a file.

The standard measures it from the direction of the traffic that a signal applies to (14.1). Some
exporters measure it from the reference line, others give the direction of the face. A file is
consistent, and signals face their traffic. The reading with the most signals that face their
traffic is therefore correct.
"""

import math
from collections.abc import Iterable
from typing import TypeAlias

from envgen_usd.models.road import Road
from envgen_usd.models.signals import Signal

Facing: TypeAlias = dict[str, float]
"""Angle in radians from the reference line to the face at hOffset 0, by orientation."""
FROM_TRAFFIC: Facing = {"+": math.pi, "-": 0.0, "none": math.pi}
"""Facing of the standard."""
FROM_LINE: Facing = {"+": math.pi, "-": math.pi, "none": math.pi}
OF_FACE: Facing = {"+": 0.0, "-": 0.0, "none": 0.0}


def facing_of(roads: Iterable[Road]) -> Facing:
    """Returns the facing of a file's signals; in doubt that of the standard."""
    signals = [
        signal
        for road in roads
        for signal in road.signals
        if not signal.reference and signal.position is None and signal.orientation in {"+", "-"}
    ]
    return max((FROM_TRAFFIC, FROM_LINE, OF_FACE), key=lambda facing: _fit(facing, signals))


def face_angle(facing: Facing, signal: Signal) -> float:
    """Returns the angle from the reference line to the direction of a signal's face, radians."""
    return facing.get(signal.orientation, facing["none"]) + signal.heading


def _fit(facing: Facing, signals: list[Signal]) -> float:
    """Sums the cosines between the signals' faces and the direction to their traffic."""
    fit = sum(
        math.cos(face_angle(facing, signal) - FROM_TRAFFIC[signal.orientation])
        for signal in signals
    )
    return round(fit, 6)
