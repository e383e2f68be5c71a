"""Reads the plan view: the geometries of a road's reference line (chapter 9)."""

from itertools import pairwise

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.plan_view import PlanView
from envgen_usd.opendrive.document.findings import Element, Findings, Unusable, remove
from envgen_usd.opendrive.document.number_attributes import placing, write
from envgen_usd.opendrive.elements.broken_geometries import FARTHEST, repair_geometries
from envgen_usd.opendrive.elements.cubic_elements import sort_siblings
from envgen_usd.opendrive.elements.geometry_element import Shape, read_curve
from envgen_usd.opendrive.elements.stray_geometries import place_strays

LARGEST_STEP = 100.0
"""Largest step of s, metres, that no geometry covers; a larger value lets a line go on for longer.
"""
SHORTEST = 1e-6
"""Shortest geometry in metres; shorter geometries change no position and are left out."""


def read_plan_view(element: Element, findings: Findings) -> PlanView:
    """Reads a planView element.

    Unusable geometries are repaired from their neighbours (`repair_geometries`).

    Args:
        element: The planView; repaired in place.
        findings: Collects the issues.

    Raises:
        Unusable: The planView has no geometry with a usable position.
    """
    try:
        elements, rows = _geometries(element, findings)
    except Unusable as error:
        repair_geometries(element, error, findings)
        elements, rows = _geometries(element, findings)
    elements, rows, table = _sorted(elements, rows, findings)
    while place_strays(element, elements, table, findings):
        elements, rows, table = _sorted(*_geometries(element, findings), findings)
    if table[0, 0] != 0:
        _start_at_zero(elements, table, findings)
    _close_jumps(elements, table, findings)
    return _plan_view(table, [shape for _, shape in rows])


def _sorted(
    elements: list[Element], rows: list[tuple[list[float], Shape]], findings: Findings
) -> tuple[list[Element], list[tuple[list[float], Shape]], np.ndarray]:
    """Geometries in order of s, and a table of their figures."""
    table = np.array([row for row, _ in rows])
    if any(row[0] > after[0] for (row, _), (after, _) in pairwise(rows)):
        order = sort_siblings(elements, table[:, 0], "s", findings)
        table, rows = table[order], [rows[index] for index in order]
        elements = [elements[index] for index in order]
    return elements, rows, table


def _geometries(
    element: Element, findings: Findings
) -> tuple[list[Element], list[tuple[list[float], Shape]]]:
    """Reads all geometries with a length: element, (s, x, y, heading, length), curve."""
    elements, rows = [], []
    for geometry in list(element.iterchildren("geometry")):
        row = placing(geometry, ("s", "x", "y", "hdg", "length"), findings)
        if max(abs(row[1]), abs(row[2])) > FARTHEST:
            raise Unusable(
                geometry, "plan_view.far", f"x={row[1]:g}, y={row[2]:g} is off the Earth"
            )
        if row[4] >= SHORTEST:
            elements.append(geometry)
            rows.append((row, read_curve(geometry, row[4], findings)))
        else:
            text = f"length {row[4]:g} m"
            findings.repaired("plan_view.too_short", geometry, text, "left out", Severity.INFO)
            remove(geometry)
    if not rows:
        raise Unusable(element, "plan_view.empty", "no geometry has a length")
    return elements, rows


def _plan_view(table: np.ndarray, shapes: list[Shape]) -> PlanView:
    kinds, starts, ends, cubics, ranges = zip(*shapes, strict=True)
    s, x, y, heading, length = np.ascontiguousarray(table.T)
    return PlanView(
        s,
        x,
        y,
        heading,
        length,
        np.array(kinds, dtype=np.int64),
        np.array((starts, ends), dtype=np.float64).T.copy(),
        np.array(cubics, dtype=np.float64),
        np.array(ranges, dtype=np.float64),
    )


def _start_at_zero(elements: list[Element], table: np.ndarray, findings: Findings) -> None:
    text = f"the first geometry starts at s={table[0, 0]:g}"
    findings.repaired("plan_view.start", elements[0], text, "s of all geometries shifted to 0")
    table[:, 0] -= table[0, 0]
    for element, s in zip(elements, table[:, 0], strict=True):
        element.set("s", write(s))


def _close_jumps(elements: list[Element], table: np.ndarray, findings: Findings) -> None:
    """Moves geometries back that start far beyond the end of the one before.

    The one before would go on to them, over kilometres that no geometry describes.
    """
    steps = table[1:, 0] - table[:-1, 0] - table[:-1, 4]
    far = np.where(steps > LARGEST_STEP, steps, 0.0)
    if not far.any():
        return
    for place in np.flatnonzero(far):
        text = f"s is {far[place]:g} m beyond the end of the previous geometry"
        done = "s of this and all later geometries reduced"
        findings.repaired("plan_view.s_jump", elements[place + 1], text, done)
    table[1:, 0] -= np.cumsum(far)
    for element, s in zip(elements, table[:, 0], strict=True):
        element.set("s", write(s))
