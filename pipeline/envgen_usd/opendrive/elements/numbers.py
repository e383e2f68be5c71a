"""Numbers in attributes, also where they are written badly."""

import math
import re
from collections.abc import Sequence

from envgen_usd.opendrive.findings import Element, Findings, Unusable

LARGEST = 1e12
"""Numbers beyond this describe no road; they are taken like infinity."""
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)"
_FORTRAN = re.compile(rf"({_NUMBER})[dD]?([+-]\d+)\s*$")
_LEADING = re.compile(rf"{_NUMBER}(?:[eE][+-]?\d+)?")


def number(element: Element, name: str, findings: Findings, default: float = 0.0) -> float:
    """Value of an attribute that may be absent.

    Args:
        element: Its element.
        name: Its name.
        findings: Takes an issue where the value is no finite number; the attribute is mended.
        default: Value where it is absent or cannot be read.
    """
    text = element.get(name)
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        return _mend(element, name, findings, default)
    return value if abs(value) <= LARGEST else _mend(element, name, findings, default)


def needed(element: Element, name: str, findings: Findings, default: float = 0.0) -> float:
    """Value of an attribute that the standard demands; where it is absent it is added."""
    if element.get(name) is None:
        text = write(default)
        findings.mended("attribute.missing", element, f"{name} is missing", f"taken as {text}")
        element.set(name, text)
        return default
    return number(element, name, findings, default)


def placing(element: Element, names: Sequence[str], findings: Findings) -> list[float]:
    """Values without which a road cannot be placed.

    Raises:
        Unusable: One of them is missing, or is not a finite number.
    """
    values = []
    for name in names:
        text = element.get(name)
        if text is None:
            raise Unusable(element, "attribute.missing", f"{name} is missing")
        value = read(text)
        if value is None:
            raise Unusable(element, "number.not_finite", f"{name}={text!r} is no finite number")
        if not is_plain(text):
            _report(element, name, findings, value)
        values.append(value)
    return values


def read(text: str) -> float | None:
    """Number in a text, or nothing where there is no finite one.

    Besides what the standard allows: a decimal comma, an exponent without its letter
    (``0.000000+0``), and a number followed by other text (``3.5m``).
    """
    try:
        value = float(text)
    except ValueError:
        value = _read_bad(text.strip().replace(",", "."))
    return value if abs(value) <= LARGEST else None


def is_plain(text: str) -> bool:
    """Whether a text is a number as the standard writes it."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def write(value: float) -> str:
    """Shortest text that reads back as the same number."""
    return repr(float(value))


def _read_bad(text: str) -> float:
    fortran = _FORTRAN.match(text)
    if fortran:
        return float(f"{fortran[1]}e{fortran[2]}")
    leading = _LEADING.match(text)
    return float(leading[0]) if leading else math.nan


def _mend(element: Element, name: str, findings: Findings, default: float) -> float:
    value = read(element.get(name) or "")
    _report(element, name, findings, default if value is None else value)
    return default if value is None else value


def _report(element: Element, name: str, findings: Findings, value: float) -> None:
    text = element.get(name, "")
    kind = "number.malformed" if read(text) is not None else "number.not_finite"
    found = f"{name}={text!r} is no finite number"
    if math.isnan(value):
        findings.mended(kind, element, found, "taken as not given")
        del element.attrib[name]
        return
    findings.mended(kind, element, found, f"taken as {write(value)}")
    element.set(name, write(value))
