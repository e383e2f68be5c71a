"""Converts speeds to metres per second."""

import math

from envgen_usd.opendrive.document.findings import Element, Findings
from envgen_usd.opendrive.document.number_attributes import number

METRES_PER_SECOND = {
    "": 1.0,
    "m/s": 1.0,
    "ms": 1.0,
    "km/h": 1 / 3.6,
    "kmh": 1 / 3.6,
    "kph": 1 / 3.6,
    "mph": 0.44704,
    "mp/h": 0.44704,
}


def speed(element: Element, findings: Findings) -> float:
    """Returns the speed limit of a speed element in m/s (8.3.1, 11.8.2).

    Infinity for ``no limit``; 0 for ``undefined`` and for an absent limit.
    """
    text = element.get("max", "").strip().lower()
    if text in {"", "undefined"}:
        return 0.0
    if text == "no limit":
        return math.inf
    unit = element.get("unit", "").strip().lower()
    if unit not in METRES_PER_SECOND:
        findings.repaired("speed.unit", element, f"unit {unit!r} is unknown", "treated as m/s")
        element.set("unit", "m/s")
    value = number(element, "max", findings) * METRES_PER_SECOND.get(unit, 1.0)
    return max(value, 0.0)
