"""Repetitions of objects (13.2)."""

import math

from envgen_usd.errors import Severity
from envgen_usd.models.road_objects import Repeat
from envgen_usd.opendrive.elements.numbers import needed, number
from envgen_usd.opendrive.findings import Element, Findings, remove

CLOSEST = 0.05
"""Metres between instances, below which nobody could tell them apart."""
LONGEST = 1e6
"""Length in metres that no road has."""


def read_repeats(element: Element, findings: Findings) -> tuple[Repeat, ...]:
    """Repeats of an object; those that no road has are left out."""
    found = (_repeat(each, findings) for each in list(element.iterchildren("repeat")))
    return tuple(repeat for repeat in found if repeat is not None)


def _repeat(element: Element, findings: Findings) -> Repeat | None:
    s = needed(element, "s", findings)
    length, distance = number(element, "length", findings), number(element, "distance", findings)
    if length < 0 or distance < 0:
        text = f"length {length:g} m, distance {distance:g} m"
        findings.mended("repeat.negative", element, text, "repeat left out")
        remove(element)
        return None
    if length > LONGEST:
        _leave_out(element, f"a repeat over {length:g} m", findings)
        return None
    if 0 < distance < min(CLOSEST, length):
        _leave_out(element, f"{length / distance:.3g} instances of one object", findings)
        return None
    pairs = {name: _pair(element, name, findings) for name in ("t", "zOffset", "width", "height")}
    return Repeat(
        s,
        length,
        distance,
        pairs["t"],
        pairs["zOffset"],
        pairs["width"],
        pairs["height"],
        _pair(element, "length", findings),
        _pair(element, "radius", findings),
        element.get("detachFromReferenceLine") in {"true", "1"},
    )


def _leave_out(element: Element, text: str, findings: Findings) -> None:
    findings.mended("repeat.endless", element, text, "repeat left out", Severity.ERROR)
    remove(element)


def _pair(element: Element, name: str, findings: Findings) -> tuple[float, float]:
    """Values at start and end; NaN where there is none."""
    start, end = (
        number(element, f"{name}{place}", findings, math.nan) for place in ("Start", "End")
    )
    return start, start if math.isnan(end) else end
