"""Over which range the parameter of a paramPoly3 runs (9.6)."""

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.opendrive.findings import Element, Findings

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_FAR_OFF = 0.2
"""A declared range is doubted where the arc length is wrong by more than this share ..."""
_MUCH_BETTER = 3.0
"""... and the other range fits this many times better."""


def p_range(element: Element, cubic: tuple[float, ...], length: float, findings: Findings) -> float:
    """Value of p at the geometry's end: 1 if normalised, else its length.

    The attribute pRange says which; where it is missing, or fits the geometry's length badly while
    the other fits well, the one that fits is taken.

    Args:
        element: The paramPoly3; gets the pRange that was taken.
        cubic: aU, bU, cU, dU, aV, bV, cV, dV.
        length: Declared length of the geometry in metres.
        findings: Takes the issues.
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
    findings.mended("plan_view.p_range", element, text, f"taken as {value}", severity)
    element.set("pRange", value)


def _fits(declared: str, cubic: tuple[float, ...], length: float) -> bool:
    """Quick test that needs no integral: the speed at the start, which is 1 where p is s."""
    speed = float(np.hypot(cubic[1], cubic[5]))
    expected = length if declared == "normalized" else 1.0
    return abs(speed / expected - 1) < _FAR_OFF


def _arc_length(cubic: tuple[float, ...], end: float) -> float:
    """Length of the curve from p = 0 to the end, by Gauss-Legendre quadrature."""
    p = (_NODES + 1) * (end / 2)
    _, b_u, c_u, d_u, _, b_v, c_v, d_v = cubic
    du = b_u + p * (2 * c_u + 3 * d_u * p)
    dv = b_v + p * (2 * c_v + 3 * d_v * p)
    return float(np.hypot(du, dv) @ _WEIGHTS) * end / 2
