"""Reads piecewise cubics: elevation, width, border, laneOffset, ..."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import LARGEST, needed, read, write

NAMES = ("a", "b", "c", "d")
Row: TypeAlias = tuple[float, float, float, float, float]


def read_cubics(elements: Sequence[Element], start: str, findings: Findings) -> Cubics:
    """Reads cubics from elements with a start and coefficients a, b, c, d.

    The reader omits pieces without finite numbers and sorts pieces by their start.

    Args:
        elements: Sibling elements, each a piece.
        start: Name of the start attribute: ``s``, ``sOffset`` or ``t``.
        findings: Collects the issues.
    """
    if not elements:
        return NO_CUBICS
    try:
        rows = [_plain(element, start) for element in elements]
    except (TypeError, ValueError):
        elements, rows = _careful(elements, start, findings)
        if not rows:
            return NO_CUBICS
    table = np.array(rows)
    if any(row[0] > after[0] for row, after in pairwise(rows)):
        table = table[sort_siblings(elements, table[:, 0], start, findings)]
    # The parts of a table that cannot be written to need no protection of their own.
    table.flags.writeable = False
    return Cubics(table[:, 0], table[:, 1:])


def sort_siblings(
    elements: Sequence[Element], starts: FloatArray, name: str, findings: Findings
) -> list[int]:
    """Sorts siblings in the tree, reports the repair, and returns the order."""
    order = [int(index) for index in np.argsort(starts, kind="stable")]
    first = elements[0]
    findings.repaired(
        "order.descending", first, f"{first.tag} elements are not in order of {name}", "sorted"
    )
    parent = first.getparent()
    if parent is not None:
        places = sorted(parent.index(element) for element in elements)
        for element in elements:
            parent.remove(element)
        for place, index in zip(places, order, strict=True):
            parent.insert(place, elements[index])
    return order


def _plain(element: Element, start: str) -> Row:
    get = element.get
    s, a = float(get(start)), float(get("a"))  # type: ignore[arg-type]
    b, c, d = float(get("b")), float(get("c")), float(get("d"))  # type: ignore[arg-type]
    # A sum beyond the largest number is no fault yet, but worth the careful reading.
    if not abs(s) + abs(a) + abs(b) + abs(c) + abs(d) < LARGEST or (s < 0 and start != "t"):
        raise ValueError
    return s, a, b, c, d


def _careful(
    elements: Sequence[Element], start: str, findings: Findings
) -> tuple[list[Element], list[Row]]:
    kept, rows = [], []
    for element in elements:
        bad = [name for name in (start, *NAMES) if read(element.get(name, "0")) is None]
        if bad:
            text = f"{', '.join(bad)} of {element.tag} is not a finite number"
            findings.repaired("number.not_finite", element, text, "piece left out")
            remove(element)
            continue
        s, a, b, c, d = (needed(element, name, findings) for name in (start, *NAMES))
        if s < 0 and start != "t":
            s, a, b, c, d = _clamp((s, a, b, c, d), element, start, findings)
        kept.append(element)
        rows.append((s, a, b, c, d))
    return kept, rows


def _clamp(row: Row, element: Element, start: str, findings: Findings) -> Row:
    """Returns the same cubic with its start at 0."""
    s, a, b, c, d = row
    moved = 0.0, a - s * (b - s * (c - s * d)), b - s * (2 * c - 3 * s * d), c - 3 * s * d, d
    findings.repaired(
        "number.negative_start", element, f"{start}={s!r} is below 0", "moved to 0", Severity.INFO
    )
    for name, value in zip((start, *NAMES), moved, strict=True):
        element.set(name, write(value))
    return moved
