"""Evaluates the plan view of a road (ASAM OpenDRIVE 1.8.1, 9.3 to 9.7)."""

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.plan_view import Curve, PlanView

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
_PANEL_ANGLE = 3.0
"""Turn in radians per panel of 12 Gauss-Legendre nodes, which are exact to rounding for it."""
_MOST_PANELS = 256
"""Largest number of panels of a clothoid; bounds the cost of steep spirals."""
_NEWTON_STEPS = 8
"""Newton iterations for u of a poly3; a larger value reduces the error."""


def evaluate(plan_view: PlanView, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Evaluates the reference line at many positions at once.

    Each s belongs to the last geometry that starts at or before it. Beyond a geometry's ends its
    end applies. The parameter of a paramPoly3 is proportional to the length along the geometry. Its
    declared length may therefore differ from its arc length.

    Args:
        plan_view: G geometries, G >= 1.
        s: Metres along the reference line, any shape.

    Returns:
        x, y (metres, road frame) and heading (radians, not wrapped), each of the shape of s.
    """
    flat = np.ravel(np.asarray(s, dtype=np.float64))
    shape = np.shape(s)
    x, y, heading = evaluate_at(plan_view, _piece(plan_view, flat), flat)
    return x.reshape(shape), y.reshape(shape), heading.reshape(shape)


def evaluate_at(
    plan_view: PlanView, piece: IntArray, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Evaluates the geometries with the indices `piece` (N) at each s (N) as in `evaluate`.

    The geometries may be those of several reference lines.
    """
    ds = np.clip(s - plan_view.s[piece], 0.0, plan_view.length[piece])
    u, v, turn = _local(plan_view, piece, ds)
    heading = plan_view.heading[piece]
    cosine, sine = np.cos(heading), np.sin(heading)
    x = plan_view.x[piece] + u * cosine - v * sine
    y = plan_view.y[piece] + u * sine + v * cosine
    return x, y, heading + turn


def _piece(plan_view: PlanView, s: FloatArray) -> IntArray:
    """Returns the last geometry that starts at or before each s."""
    piece: IntArray = np.maximum(np.searchsorted(plan_view.s, s, side="right") - 1, 0)
    return piece


def bend(plan_view: PlanView, s: FloatArray) -> FloatArray:
    """Returns the bend of a reference line at each s (N), in 1/m; see `bends_at`."""
    return bends_at(plan_view, _piece(plan_view, s), s)


def bends_at(plan_view: PlanView, piece: IntArray, s: FloatArray) -> FloatArray:
    """Returns the magnitude of the position's second derivative by s across the curve, in 1/m.

    For non-polynomial curves it equals the curvature. It bounds the chord error of a step h by
    ``bend * h**2 / 8``.

    Args:
        plan_view: Geometries, also of several reference lines.
        piece: N, index of a geometry.
        s: N, metres along the reference line of the geometry.
    """
    length = np.maximum(plan_view.length[piece], 1e-9)
    part = np.clip((s - plan_view.s[piece]) / length, 0.0, 1.0)
    start, end = plan_view.curvature[piece].T
    magnitude: FloatArray = np.abs(start + (end - start) * part)
    kind = plan_view.kind[piece]
    if kind.max(initial=Curve.LINE) <= Curve.SPIRAL:
        return magnitude
    cubic = plan_view.cubic[piece]
    graph = kind == Curve.POLY3
    magnitude[graph] = np.abs(2 * cubic[graph, 2] + 6 * cubic[graph, 3] * (part * length)[graph])
    free = kind == Curve.PARAM_POLY3
    p_range = plan_view.p_range[piece[free]]
    p = (part[free] * p_range)[:, None]
    _, b, c, d = (cubic[free][:, [k, k + 4]] for k in range(4))
    first, second = b + p * (2 * c + p * 3 * d), 2 * c + 6 * p * d
    across = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    speed = np.maximum(np.hypot(*first.T), 1e-9)
    magnitude[free] = np.abs(across) / speed * (p_range / length[free]) ** 2
    return magnitude


def _local(
    plan_view: PlanView, piece: IntArray, ds: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns u, v and turn in each geometry's local frame; lines and arcs share a formula."""
    kind = plan_view.kind[piece]
    half = plan_view.curvature[piece, 0] * ds / 2
    chord = ds * np.sinc(half / np.pi)
    u, v, turn = chord * np.cos(half), chord * np.sin(half), 2 * half
    if kind.max(initial=Curve.LINE) <= Curve.ARC:
        return u, v, turn
    for curve, function in (
        (Curve.SPIRAL, _spiral),
        (Curve.POLY3, _poly3),
        (Curve.PARAM_POLY3, _param_poly3),
    ):
        chosen = np.flatnonzero(kind == curve)
        if len(chosen):
            u[chosen], v[chosen], turn[chosen] = function(plan_view, piece[chosen], ds[chosen])
    return u, v, turn


def _spiral(
    plan_view: PlanView, piece: IntArray, ds: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Integrates a clothoid by Gauss-Legendre panels of bounded turn; exact also for near arcs."""
    start, end = plan_view.curvature[piece].T
    rate = (end - start) / np.maximum(plan_view.length[piece], 1e-12)
    angle = (np.abs(start) + np.abs(rate) * ds / 2) * ds
    panels = np.clip(np.ceil(angle / _PANEL_ANGLE), 1, _MOST_PANELS).astype(np.int64)
    owner = np.repeat(np.arange(len(ds)), panels)
    first = np.cumsum(panels) - panels
    step = (ds / panels)[owner]
    at = (np.arange(len(owner)) - first[owner])[:, None] * step[:, None] + step[:, None] * _NODES
    phase = at * (start[owner][:, None] + rate[owner][:, None] * at / 2)
    u = np.add.reduceat((np.cos(phase) @ _WEIGHTS) * step, first)
    v = np.add.reduceat((np.sin(phase) @ _WEIGHTS) * step, first)
    return u, v, ds * (start + rate * ds / 2)


def _poly3(
    plan_view: PlanView, piece: IntArray, ds: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Evaluates the graph v(u) (9.6); Newton's method gives u from the arc length."""
    a, b, c, d = plan_view.cubic[piece, :4].T
    u = ds.copy()
    for _ in range(_NEWTON_STEPS):
        node = u[:, None] * _NODES
        slope = b[:, None] + node * (2 * c[:, None] + node * 3 * d[:, None])
        arc = u * (np.hypot(1.0, slope) @ _WEIGHTS)
        u = np.clip(u - (arc - ds) / np.hypot(1.0, b + u * (2 * c + u * 3 * d)), 0.0, ds)
    return u, a + u * (b + u * (c + u * d)), np.arctan(b + u * (2 * c + u * 3 * d))


def _param_poly3(
    plan_view: PlanView, piece: IntArray, ds: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Evaluates a parametric cubic (9.7)."""
    p = ds / np.maximum(plan_view.length[piece], 1e-12) * plan_view.p_range[piece]
    a, b, c, d, e, f, g, h = plan_view.cubic[piece].T
    u, v = a + p * (b + p * (c + p * d)), e + p * (f + p * (g + p * h))
    du, dv = b + p * (2 * c + p * 3 * d), f + p * (2 * g + p * 3 * h)
    return u, v, np.arctan2(dv, du)
