"""The reference line of a road (ASAM OpenDRIVE, chapter 9)."""

from dataclasses import dataclass
from enum import IntEnum

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.frozen_model import Model


class Curve(IntEnum):
    """Kinds of plan-view geometry (9.3 to 9.7)."""

    LINE = 0
    ARC = 1
    SPIRAL = 2
    POLY3 = 3
    PARAM_POLY3 = 4


@dataclass(frozen=True, repr=False, eq=False)
class PlanView(Model):
    """Reference line of a road (chapter 9) as G geometries.

    Attributes:
        s: G, metres, start of each geometry, ascending.
        x: G, metres, at the start.
        y: G, metres, at the start.
        heading: G, radians, at the start.
        length: G, metres.
        kind: G, `Curve` values.
        curvature: G x 2, curvature at start and end in 1/m (line: 0, 0; arc: equal).
        cubic: G x 8, for POLY3 (a, b, c, d, 0, 0, 0, 0), for PARAM_POLY3
            (aU, bU, cU, dU, aV, bV, cV, dV).
        p_range: G, p at the end of a PARAM_POLY3: 1 if normalised, otherwise its length.
    """

    s: FloatArray
    x: FloatArray
    y: FloatArray
    heading: FloatArray
    length: FloatArray
    kind: IntArray
    curvature: FloatArray
    cubic: FloatArray
    p_range: FloatArray
