"""Reads signals and signal references of a road (chapter 14)."""

import math

from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.document.findings import Element, Findings, line_of
from envgen_usd.opendrive.document.number_attributes import number
from envgen_usd.opendrive.elements.kept_elements import leftovers, others

_NUMBERS = ("s", "t", "zOffset", "hOffset", "pitch", "roll", "width", "height", "value")
_TEXTS = ("id", "name", "type", "subtype", "country", "orientation", "dynamic", "unit", "text")
_ATTRIBUTES = frozenset({*_NUMBERS, *_TEXTS})
_KNOWN = frozenset({"positionInertial"})


def read_signals(road: Element, findings: Findings) -> tuple[Signal, ...]:
    """Reads all signals of a road, in the file's order."""
    signals = []
    for group in road.iterchildren("signals"):
        for element in group.iterchildren("signal", "signalReference"):
            signals.append(_signal(element, findings))
    return tuple(signals)


def _signal(element: Element, findings: Findings) -> Signal:
    get = element.get
    inertial = element.find("positionInertial")
    pose = element if inertial is None else inertial
    return Signal(
        get("id", ""),
        get("name", ""),
        get("type", ""),
        get("subtype", ""),
        get("country", ""),
        number(element, "s", findings),
        number(element, "t", findings),
        number(element, "zOffset", findings),
        number(pose, "hOffset" if inertial is None else "hdg", findings),
        number(pose, "pitch", findings),
        number(pose, "roll", findings),
        get("orientation", "none"),
        get("dynamic") in {"yes", "true", "1"},
        number(element, "width", findings),
        number(element, "height", findings),
        _value(element, findings),
        get("unit", ""),
        get("text", ""),
        None if inertial is None else _position(inertial, findings),
        get("id", "") if element.tag == "signalReference" else "",
        (*leftovers(element, _ATTRIBUTES), *others(element, _KNOWN)),
        line_of(element),
    )


def _value(element: Element, findings: Findings) -> float:
    """Reads the value on the face; exporters write an empty text or -1 for no value."""
    if not element.get("value", "").strip():
        return math.nan
    return number(element, "value", findings, math.nan)


def _position(element: Element, findings: Findings) -> tuple[float, float, float]:
    x, y, z = (number(element, name, findings) for name in "xyz")
    return x, y, z
