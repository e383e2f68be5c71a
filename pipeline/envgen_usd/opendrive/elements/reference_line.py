"""The plan view: geometries of a road's reference line (chapter 9)."""

from typing import TypeAlias

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.plan_view import Curve, PlanView
from envgen_usd.opendrive.elements.cubics import NAMES, sort_siblings
from envgen_usd.opendrive.elements.numbers import number, placing, write
from envgen_usd.opendrive.elements.param_poly import p_range
from envgen_usd.opendrive.findings import Element, Findings, Unusable, remove

PARAM_NAMES = ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV")
SHORTEST = 1e-6
"""Geometries below this length in metres are left out: they turn or move nothing."""
FARTHEST = 1e8
"""Metres from the origin, in x or y, within which roads can lie."""
Shape: TypeAlias = tuple[Curve, float, float, tuple[float, ...], float]
_NO_CUBIC = (0.0,) * 8


def read_plan_view(element: Element, findings: Findings) -> PlanView:
    """Reads a planView element.

    Args:
        element: The planView; mended where it has to be.
        findings: Takes the issues.

    Raises:
        Unusable: There is no geometry, or one is not placed by finite numbers.
    """
    elements, rows = [], []
    for geometry in list(element.iterchildren("geometry")):
        row = placing(geometry, ("s", "x", "y", "hdg", "length"), findings)
        if max(abs(row[1]), abs(row[2])) > FARTHEST:
            raise Unusable(
                geometry, "plan_view.far", f"x={row[1]:g}, y={row[2]:g} is off the Earth"
            )
        if row[4] >= SHORTEST:
            elements.append(geometry)
            rows.append((row, _shape(geometry, row[4], findings)))
        else:
            text = f"length {row[4]:g} m"
            findings.mended("plan_view.too_short", geometry, text, "left out", Severity.INFO)
            remove(geometry)
    if not rows:
        raise Unusable(element, "plan_view.empty", "no geometry has a length")
    table = np.array([row for row, _ in rows])
    if (np.diff(table[:, 0]) < 0).any():
        order = sort_siblings(elements, table[:, 0], "s", findings)
        table, rows = table[order], [rows[index] for index in order]
        elements = [elements[index] for index in order]
    if table[0, 0] != 0:
        _start_at_zero(elements, table, findings)
    return _plan_view(table, [shape for _, shape in rows])


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
    findings.mended("plan_view.start", elements[0], text, "s of all geometries moved to begin at 0")
    table[:, 0] -= table[0, 0]
    for element, s in zip(elements, table[:, 0], strict=True):
        element.set("s", write(s))


def _shape(geometry: Element, length: float, findings: Findings) -> Shape:
    """Kind, curvature at start and end, cubics, and range of p."""
    for child in geometry.iterchildren("*"):
        if child.tag == "line":
            return Curve.LINE, 0.0, 0.0, _NO_CUBIC, 1.0
        if child.tag == "arc":
            (curvature,) = placing(child, ("curvature",), findings)
            return _arc(child, curvature, findings)
        if child.tag == "spiral":
            start, end = placing(child, ("curvStart", "curvEnd"), findings)
            return _spiral(child, start, end, findings)
        if child.tag == "poly3":
            cubic = tuple(number(child, name, findings) for name in NAMES)
            return Curve.POLY3, 0.0, 0.0, (*cubic, 0.0, 0.0, 0.0, 0.0), 1.0
        if child.tag == "paramPoly3":
            cubic = tuple(number(child, name, findings) for name in PARAM_NAMES)
            return Curve.PARAM_POLY3, 0.0, 0.0, cubic, p_range(child, cubic, length, findings)
    findings.mended("plan_view.no_shape", geometry, "no line, arc, ... in it", "taken as a line")
    geometry.insert(0, geometry.makeelement("line"))
    return Curve.LINE, 0.0, 0.0, _NO_CUBIC, 1.0


def _arc(element: Element, curvature: float, findings: Findings) -> Shape:
    if curvature != 0:
        return Curve.ARC, curvature, curvature, _NO_CUBIC, 1.0
    findings.mended(
        "plan_view.straight_arc", element, "curvature is 0", "taken as a line", Severity.INFO
    )
    element.tag = "line"
    element.attrib.clear()
    return Curve.LINE, 0.0, 0.0, _NO_CUBIC, 1.0


def _spiral(element: Element, start: float, end: float, findings: Findings) -> Shape:
    if start != end:
        return Curve.SPIRAL, start, end, _NO_CUBIC, 1.0
    text = f"curvStart and curvEnd are both {start:g}"
    kind = "line" if start == 0 else "arc"
    findings.mended("plan_view.constant_spiral", element, text, f"taken as a {kind}", Severity.INFO)
    element.tag = kind
    element.attrib.clear()
    if start == 0:
        return Curve.LINE, 0.0, 0.0, _NO_CUBIC, 1.0
    element.set("curvature", write(start))
    return Curve.ARC, start, start, _NO_CUBIC, 1.0
