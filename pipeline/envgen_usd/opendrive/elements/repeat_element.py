"""Reads repetitions of objects (13.2)."""

import math
from collections.abc import Callable

from envgen_usd.errors import Severity
from envgen_usd.models.road_objects import Repeat
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import needed, number, size

CLOSEST = 0.05
"""Least spacing of instances in metres; a closer spacing is hostile."""
LONGEST = 1e6
"""Largest length of a repeat in metres; longer repeats are hostile."""
_Value = Callable[[Element, str, Findings, float], float]


def read_repeats(element: Element, findings: Findings) -> tuple[Repeat, ...]:
    """Reads the repeats of an object; repeats beyond the bounds are left out."""
    repeats = (_repeat(each, findings) for each in list(element.iterchildren("repeat")))
    return tuple(repeat for repeat in repeats if repeat is not None)


def _repeat(element: Element, findings: Findings) -> Repeat | None:
    s = needed(element, "s", findings)
    length, distance = number(element, "length", findings), number(element, "distance", findings)
    if length < 0 or distance < 0:
        text = f"length {length:g} m, distance {distance:g} m"
        findings.repaired("repeat.negative", element, text, "repeat left out")
        remove(element)
        return None
    if length > LONGEST:
        _leave_out(element, f"the repeat is {length:g} m long", findings)
        return None
    if 0 < distance < min(CLOSEST, length):
        _leave_out(element, f"the repeat has {length / distance:.3g} instances", findings)
        return None
    return Repeat(
        s,
        length,
        distance,
        _pair(element, "t", findings),
        _pair(element, "zOffset", findings),
        _pair(element, "width", findings, size),
        _pair(element, "height", findings, size),
        _pair(element, "length", findings, size),
        _pair(element, "radius", findings, size),
        element.get("detachFromReferenceLine") in {"true", "1"},
    )


def _leave_out(element: Element, text: str, findings: Findings) -> None:
    findings.repaired("repeat.endless", element, text, "repeat left out", Severity.ERROR)
    remove(element)


def _pair(
    element: Element, name: str, findings: Findings, value: _Value = number
) -> tuple[float, float]:
    """Returns the values at start and end; NaN for an absent value."""
    start, end = (
        value(element, f"{name}{place}", findings, math.nan) for place in ("Start", "End")
    )
    return start, start if math.isnan(end) else end
