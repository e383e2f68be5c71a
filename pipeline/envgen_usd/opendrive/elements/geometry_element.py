"""Reads the curve of a geometry: line, arc, spiral, poly3, paramPoly3 (9.3 to 9.7)."""

import math
from typing import TypeAlias

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.plan_view import Curve
from envgen_usd.opendrive.document.findings import Element, Findings, Unusable
from envgen_usd.opendrive.document.number_attributes import number, placing, write
from envgen_usd.opendrive.elements.cubic_elements import NAMES
from envgen_usd.opendrive.elements.param_poly_range import p_range

PARAM_NAMES = ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV")
MOST_SAMPLES = 100_000
"""Largest number of samples of a curve; more samples are hostile."""
DENSEST = 20.0
"""Most samples per metre of a curve above `_FEW` samples; 20 correspond to a radius of 1.6 cm."""
_FEW = 1000
"""Samples that every curve may request, however short."""
MOST_TURN = 63.0
"""Largest turn of a curve in radians, 10 rounds; tighter curves only cover themselves."""
TIGHTEST = 10.0
"""Largest curvature of an arc or spiral in 1/m; lanes beside a tighter curve fold into a fan."""
LONGEST_REACH = 10.0
"""Largest distance of a cubic from the geometry's place, as a multiple of its length; and largest
length that is stated for it, as a multiple of its own."""
_ALLOWED = 100.0
"""Metres from its place that every cubic may reach, however short its geometry is said to be."""
_PROBES = np.linspace(0.0, 1.0, 9)
_TOLERANCE = 0.02
"""Chord error in metres for the estimate of samples; a larger value estimates fewer samples."""
Shape: TypeAlias = tuple[Curve, float, float, tuple[float, ...], float]
"""Kind, curvature at start and end in 1/m, cubics, and range of p."""
_NO_CUBIC = (0.0,) * 8
_STRAIGHT: Shape = (Curve.LINE, 0.0, 0.0, _NO_CUBIC, 1.0)


def read_curve(geometry: Element, length: float, findings: Findings) -> Shape:
    """Reads the curve of a geometry; a geometry without a curve is a line.

    Args:
        geometry: The geometry; repaired in place.
        length: Length of the geometry in metres.
        findings: Collects the issues.

    Raises:
        Unusable: A required value is missing, or the curve exceeds `MOST_SAMPLES`, `DENSEST`,
            `MOST_TURN`, `TIGHTEST` or `LONGEST_REACH`.
    """
    curve = _curve(geometry, length, findings)
    if curve[0] != Curve.LINE:
        _refuse_endless(geometry, curve, length)
    if curve[0] in {Curve.POLY3, Curve.PARAM_POLY3}:
        _refuse_far(geometry, curve, length)
    return curve


def _curve(geometry: Element, length: float, findings: Findings) -> Shape:
    for child in geometry.iterchildren("*"):
        if child.tag == "line":
            return _STRAIGHT
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
    findings.repaired(
        "plan_view.no_shape", geometry, "the geometry has no curve", "treated as a line"
    )
    geometry.insert(0, geometry.makeelement("line"))
    return _STRAIGHT


def _arc(element: Element, curvature: float, findings: Findings) -> Shape:
    if curvature != 0:
        return Curve.ARC, curvature, curvature, _NO_CUBIC, 1.0
    findings.repaired(
        "plan_view.straight_arc", element, "curvature is 0", "treated as a line", Severity.INFO
    )
    element.tag = "line"
    element.attrib.clear()
    return _STRAIGHT


def _spiral(element: Element, start: float, end: float, findings: Findings) -> Shape:
    if start != end:
        return Curve.SPIRAL, start, end, _NO_CUBIC, 1.0
    text = f"curvStart and curvEnd are both {start:g}"
    kind = "line" if start == 0 else "arc"
    findings.repaired(
        "plan_view.constant_spiral", element, text, f"treated as a {kind}", Severity.INFO
    )
    element.tag = kind
    element.attrib.clear()
    if start == 0:
        return _STRAIGHT
    element.set("curvature", write(start))
    return Curve.ARC, start, start, _NO_CUBIC, 1.0


def _refuse_endless(geometry: Element, curve: Shape, length: float) -> None:
    kind, start, end, cubic, p_end = curve
    steepest = max(abs(start), abs(end))
    turn = steepest * length
    if kind == Curve.SPIRAL:
        turn = _turn_of_spiral(start, end, length)
    elif kind == Curve.POLY3:
        steepest, turn = max(abs(2 * cubic[2]), abs(2 * cubic[2] + 6 * cubic[3] * length)), 0.0
    elif kind == Curve.PARAM_POLY3:
        second = (
            math.hypot(2 * cubic[2] + 6 * cubic[3] * p, 2 * cubic[6] + 6 * cubic[7] * p)
            for p in (0.0, p_end)
        )
        steepest, turn = max(second) * (p_end / length) ** 2, 0.0
    samples = length * math.sqrt(steepest / (8 * _TOLERANCE))
    if samples > MOST_SAMPLES or samples > max(DENSEST * length, _FEW):
        raise Unusable(geometry, "plan_view.endless", f"the curve requires {samples:.3g} samples")
    if turn > MOST_TURN:
        text = f"the curve winds {turn / (2 * math.pi):.3g} times around"
        raise Unusable(geometry, "plan_view.endless", text)
    if max(abs(start), abs(end)) > TIGHTEST:
        text = f"the curvature reaches {steepest:g} 1/m; the limit is {TIGHTEST:g}"
        raise Unusable(geometry, "plan_view.tight", text)


def _turn_of_spiral(start: float, end: float, length: float) -> float:
    """Integrates the magnitude of the linear curvature, which may change its sign."""
    if start * end >= 0:
        return abs(start + end) / 2 * length
    return (start * start + end * end) / (2 * abs(end - start)) * length


def _refuse_far(geometry: Element, curve: Shape, length: float) -> None:
    """A straight cubic needs few samples, and yet may lead across the Earth, or claim to."""
    kind, _, _, (a_u, b_u, c_u, d_u, a_v, b_v, c_v, d_v), p_end = curve
    if kind == Curve.POLY3:  # Its length is that of its arc, and a_u its offset.
        reach = abs(a_u) + length
    else:
        p = _PROBES * p_end
        u = a_u + p * (b_u + p * (c_u + p * d_u))
        v = a_v + p * (b_v + p * (c_v + p * d_v))
        reach = float(np.hypot(u, v).max())
        arc = float(np.hypot(np.diff(u), np.diff(v)).sum())
        if length > LONGEST_REACH * arc + _ALLOWED:
            text = f"length {length:g} m, but the curve is {arc:.3g} m long"
            raise Unusable(geometry, "plan_view.endless", text)
    if reach > LONGEST_REACH * length + _ALLOWED:
        text = f"the curve reaches {reach:.3g} m; its length is {length:g} m"
        raise Unusable(geometry, "plan_view.endless", text)
