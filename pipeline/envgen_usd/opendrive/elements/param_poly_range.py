"""Determines the parameter range of a paramPoly3 (9.6)."""

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.opendrive.document.findings import Element, Findings

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_FAR_OFF = 0.2
"""Relative error of the arc length above which a declared pRange is doubted."""
_MUCH_BETTER = 3.0
"""Factor by which the other pRange has to fit better before it replaces the declared pRange."""


def p_range(element: Element, cubic: tuple[float, ...], length: float, findings: Findings) -> float:
    """Returns p at the geometry's end: 1 if normalised, otherwise the length.

    The attribute pRange declares the range. If it is missing, or if only the other range fits the
    declared length, the better range is used.

    Args:
        element: The paramPoly3; receives the used pRange.
        cubic: aU, bU, cU, dU, aV, bV, cV, dV.
        length: Declared length of the geometry in metres.
        findings: Collects the issues.
    """
    declared = element.get("pRange")
    if declared in {"normalized", "arcLength"} and _fits(declared, cubic, length):
        return 1.0 if declared == "normalized" else length
    errors = [abs(_arc_length(cubic, end) / length - 1) for end in (1.0, length)]
    better = "normalized" if errors[0] <= errors[1] else "arcLength"
    if declared not in {"normalized", "arcLength"}:
        _take(element, f"pRange is {declared or 'missing'}", better, Severity.INFO, findings)
    elif declared != better and _MUCH_BETTER * min(errors) < max(errors) > _FAR_OFF:
        text = f"with pRange={declared} the curve is not {length:g} m long"
        _take(element, text, better, Severity.WARNING, findings)
    else:
        better = declared
    return 1.0 if better == "normalized" else length


def _take(element: Element, text: str, value: str, severity: Severity, findings: Findings) -> None:
    findings.repaired("plan_view.p_range", element, text, f"set to {value}", severity)
    element.set("pRange", value)


def _fits(declared: str, cubic: tuple[float, ...], length: float) -> bool:
    """Tests the speed at the start, which is 1 where p is s; needs no integral."""
    speed = float(np.hypot(cubic[1], cubic[5]))
    expected = length if declared == "normalized" else 1.0
    return abs(speed / expected - 1) < _FAR_OFF


def _arc_length(cubic: tuple[float, ...], end: float) -> float:
    """Integrates the length of the curve from p = 0 to the end by Gauss-Legendre quadrature."""
    p = (_NODES + 1) * (end / 2)
    _, b_u, c_u, d_u, _, b_v, c_v, d_v = cubic
    du = b_u + p * (2 * c_u + 3 * d_u * p)
    dv = b_v + p * (2 * c_v + 3 * d_v * p)
    return float(np.hypot(du, dv) @ _WEIGHTS) * end / 2
