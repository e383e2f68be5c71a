"""Numeric attributes, including badly written numbers."""

import math
import re
from collections.abc import Sequence

from envgen_usd.errors import Severity
from envgen_usd.opendrive.document.findings import Element, Findings, Unusable

LARGEST = 1e12
"""Largest magnitude of a number; the reader treats larger numbers as infinite."""
HIGHEST = 20_000.0
"""Largest height of a place in metres above or below 0."""
TALLEST = 1_000.0
"""Largest height of an object, signal, lane or mark in metres."""
_LIMITS = {
    **dict.fromkeys(("z", "dz", "zOffset", "zOffsetStart", "zOffsetEnd"), HIGHEST),
    **dict.fromkeys(("height", "heightStart", "heightEnd", "inner", "outer"), TALLEST),
}
"""Largest magnitude by the name of an attribute; `LARGEST` for all others."""
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)"
_FORTRAN = re.compile(rf"({_NUMBER})[dD]?([+-]\d+)\s*$")
_LEADING = re.compile(rf"{_NUMBER}(?:[eE][+-]?\d+)?")


def number(element: Element, name: str, findings: Findings, default: float = 0.0) -> float:
    """Returns the value of an optional attribute.

    Args:
        element: Element with the attribute.
        name: Name of the attribute.
        findings: Collects an issue for a value that is not finite or beyond its limit; the
            attribute is repaired.
        default: Value of an absent or unreadable attribute.
    """
    text = element.get(name)
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        return _repair(element, name, findings, default)
    limit = _LIMITS.get(name, LARGEST)
    return value if abs(value) <= limit else _repair(element, name, findings, default)


def needed(element: Element, name: str, findings: Findings, default: float = 0.0) -> float:
    """Returns the value of a mandatory attribute; adds an absent attribute with the default."""
    if element.get(name) is None:
        text = write(default)
        findings.repaired("attribute.missing", element, f"{name} is missing", f"set to {text}")
        element.set(name, text)
        return default
    return number(element, name, findings, default)


def size(element: Element, name: str, findings: Findings, default: float = 0.0) -> float:
    """Returns the value of an optional extent of an object; the default for a negative value."""
    value = number(element, name, findings, default)
    if value < 0:
        findings.repaired("object.negative_size", element, f"{name}={value:g}", "treated as absent")
        del element.attrib[name]
        return default
    return value


def placing(element: Element, names: Sequence[str], findings: Findings) -> list[float]:
    """Returns the values of attributes that the position of a road depends on.

    Raises:
        Unusable: An attribute is missing or is not a finite number.
    """
    values = []
    for name in names:
        text = element.get(name)
        if text is None:
            raise Unusable(element, "attribute.missing", f"{name} is missing")
        try:
            value = float(text)
        except ValueError:
            value = _read_bad(text.strip().replace(",", "."))
            if abs(value) <= LARGEST:
                _report(element, name, findings, value)
        if not abs(value) <= LARGEST:
            raise Unusable(element, "number.not_finite", f"{name}={text!r} is not a finite number")
        values.append(value)
    return values


def read(text: str) -> float | None:
    """Parses a number; `None` for a text without a finite number.

    Beyond the standard it accepts a decimal comma, an exponent without its letter
    (``0.000000+0``), and trailing text (``3.5m``).
    """
    try:
        value = float(text)
    except ValueError:
        value = _read_bad(text.strip().replace(",", "."))
    return value if abs(value) <= LARGEST else None


def write(value: float) -> str:
    """Formats a number as the shortest text that parses to the same value."""
    return repr(float(value))


def _read_bad(text: str) -> float:
    fortran = _FORTRAN.match(text)
    if fortran:
        return float(f"{fortran[1]}e{fortran[2]}")
    leading = _LEADING.match(text)
    return float(leading[0]) if leading else math.nan


def _repair(element: Element, name: str, findings: Findings, default: float) -> float:
    value = read(element.get(name) or "")
    limit = _LIMITS.get(name, LARGEST)
    if value is not None and abs(value) > limit:
        message = f"{name}={value:g} is beyond {limit:g} m"
        _replace(element, name, findings, default, ("number.beyond_bounds", message))
        return default
    _report(element, name, findings, default if value is None else value)
    return default if value is None else value


def _report(element: Element, name: str, findings: Findings, value: float) -> None:
    text = element.get(name, "")
    kind = "number.malformed" if read(text) is not None else "number.not_finite"
    _replace(element, name, findings, value, (kind, f"{name}={text!r} is not a finite number"))


def _replace(
    element: Element, name: str, findings: Findings, value: float, fault: tuple[str, str]
) -> None:
    """Writes another value, or removes the attribute for NaN; the fault is a kind and a text."""
    kind, message = fault
    severity = Severity.ERROR if kind == "number.beyond_bounds" else Severity.WARNING
    if math.isnan(value):
        findings.repaired(kind, element, message, "treated as absent", severity)
        del element.attrib[name]
        return
    findings.repaired(kind, element, message, f"read as {write(value)}", severity)
    element.set(name, write(value))
