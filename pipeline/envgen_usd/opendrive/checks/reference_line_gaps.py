"""Checks that the geometries of each reference line are continuous (9.2)."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.plan_view import Curve
from envgen_usd.models.road import Road
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.checks.joined_plan_views import Joined
from envgen_usd.opendrive.document.findings import Findings

GAP = 0.01
"""Least distance in metres between consecutive geometries that is reported."""
KINK = np.radians(1.0)
"""Least change of heading in radians between consecutive geometries that is reported."""
S_GAP = 0.01
"""Tolerated difference in metres of a geometry's s from the end of the previous geometry."""
ARC_LENGTH = 0.01
"""Tolerated relative error of a curve's declared length."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def check_reference_lines(
    roads: Sequence[Road], joined: Joined, index: Index, findings: Findings
) -> None:
    """Reports gaps, kinks, steps of s, and wrong lengths within reference lines."""
    inner = np.flatnonzero(joined.number > 0)
    before, after = joined.end[inner - 1], joined.start[inner]
    gap = np.hypot(*(after - before)[:, :2].T)
    turn = (after - before)[:, 2]
    kink = np.abs((turn + np.pi) % (2 * np.pi) - np.pi)
    s = np.concatenate([road.plan_view.s for road in roads])
    step = s[inner] - s[inner - 1] - joined.plan_view.length[inner - 1]

    def report(kind: str, geometries: IntArray, texts: list[str]) -> None:
        for place, text in zip(geometries, texts, strict=True):
            road = roads[joined.road[place]].id
            element = index.geometry(road, int(joined.number[place]))
            findings.noted(kind, element, text)

    far = np.flatnonzero(gap > GAP)
    report(
        "plan_view.gap",
        inner[far],
        [f"starts {value:.3f} m from the end of the previous geometry" for value in gap[far]],
    )
    bent = np.flatnonzero(kink > KINK)
    report(
        "plan_view.kink",
        inner[bent],
        [f"turns by {value:.2f}° from the previous geometry" for value in np.degrees(kink[bent])],
    )
    off = np.flatnonzero(np.abs(step) > S_GAP)
    report(
        "plan_view.s_gap",
        inner[off],
        [f"s is {value:.3f} m beyond the end of the previous geometry" for value in step[off]],
    )
    wrong, texts = _wrong_lengths(joined)
    report("plan_view.arc_length", wrong, texts)


def _wrong_lengths(joined: Joined) -> tuple[IntArray, list[str]]:
    """Finds parametric cubics with an arc length other than their declared length."""
    view = joined.plan_view
    curves = np.flatnonzero(view.kind == Curve.PARAM_POLY3)
    if not len(curves):
        return curves, []
    arc = _arc_lengths(view.cubic[curves], view.p_range[curves])
    length = view.length[curves]
    wrong = np.abs(arc - length) > np.maximum(ARC_LENGTH * length, GAP)
    pairs = zip(length[wrong], arc[wrong], strict=True)
    return curves[wrong], [f"length {a:.3f} m, but the curve is {b:.3f} m long" for a, b in pairs]


def _arc_lengths(cubic: FloatArray, end: FloatArray) -> FloatArray:
    """Integrates the arc lengths of N parametric cubics (N x 8) from p = 0 to the end."""
    p = np.outer(end / 2, _NODES + 1)  # N x nodes
    b, c, d = cubic[:, 1:4, None].transpose(1, 0, 2)
    f, g, h = cubic[:, 5:8, None].transpose(1, 0, 2)
    speed = np.hypot(b + p * (2 * c + p * 3 * d), f + p * (2 * g + p * 3 * h))
    lengths: FloatArray = speed @ _WEIGHTS * end / 2
    return lengths
