"""Angles of joints while walking, standing and sitting.

Walking: knee and ankle after D. A. Winter 1991, "The biomechanics and motor control of human gait"
(natural cadence), the thigh against the vertical after J. Perry 1992, "Gait analysis: normal and
pathological function", both at shares of a stride from the contact of the heel; arms after Murray,
Sepic and Barnard 1967, "Patterns of sagittal rotation of the upper limbs in walking". Figures are
rounded to a degree; those of the thigh in stance differ by up to 2 degrees from Perry's, so that
the foot on the ground does not slide.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from envgen_usd.models.array_types import FloatArray

PHASES = 8
"""Poses of a cycle; more make a smoother walk and a larger library."""

# Share of the stride, then degrees; bending forwards, at the knee backwards, toes up is positive.
_SHARE = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 0.66, 0.72, 0.8, 0.9, 0.95])
_THIGH = np.array([20, 20, 20, 16.5, 11, -0.5, -11.5, -18, -18, -13, -3, 8, 20, 25, 23])
_KNEE = np.array([4, 11, 17, 19, 17, 11, 7, 12, 22, 37, 57, 64, 53, 19, 5])
_ANKLE = np.array([0, -5, -4, -1, 3, 6, 9, 8, 0, -14, -16, -7, 0, 2, 1])
_TOES = np.array([0, 0, 0, 0, 0, 0, 4, 18, 26, 22, 8, 2, 0, 4, 4])


@dataclass(frozen=True)
class LimbAngles:
    """Angles of an arm or a leg, degrees.

    Attributes:
        swing: Of the upper part, forwards.
        apart: Of the upper part, away from the body.
        bend: Of knee or elbow.
        end: Of the foot, toes up, or of the hand, palm inwards.
        twist: Of the upper part about its axis, outwards.
        toes: Of the toes, up.
    """

    swing: float = 0.0
    apart: float = 0.0
    bend: float = 0.0
    end: float = 0.0
    twist: float = 0.0
    toes: float = 0.0


@dataclass(frozen=True)
class Pose:
    """Angles of all joints, degrees; left is the first of each pair.

    Attributes:
        legs: Left and right leg.
        arms: Left and right arm.
        pelvis: Turn forwards of its left side, drop of its left side, tilt forwards.
        trunk: Lean forwards, lean to the left, turn to the left of the chest over the pelvis.
        head: Nod forwards, turn to the left.
        sway: Shift of the pelvis to the left, metres.
        planted: True if both soles lie on the ground.
    """

    legs: tuple[LimbAngles, LimbAngles]
    arms: tuple[LimbAngles, LimbAngles]
    pelvis: tuple[float, float, float] = (0.0, 0.0, 0.0)
    trunk: tuple[float, float, float] = (0.0, 0.0, 0.0)
    head: tuple[float, float] = (0.0, 0.0)
    sway: float = 0.0
    planted: bool = False


def _spline(angles: FloatArray) -> CubicSpline:
    return CubicSpline(np.append(_SHARE, 1.0), np.append(angles, angles[0]), bc_type="periodic")


_THIGH_AT, _KNEE_AT = _spline(_THIGH), _spline(_KNEE)
_ANKLE_AT, _TOES_AT = _spline(_ANKLE), _spline(_TOES)


def _at(spline: CubicSpline, share: float) -> float:
    """Angle at a share of the stride, by a periodic spline."""
    return float(spline(share % 1.0))


def walking(share: float, vigour: float = 1.0) -> Pose:
    """The pose at a share of the stride from the contact of the right heel.

    Args:
        share: 0 to 1; half a stride later both sides have changed places.
        vigour: Factor of the angles of hips and arms: less for short steps.
    """
    sides = (share + 0.5, share)
    legs = tuple(
        LimbAngles(
            swing=vigour * _at(_THIGH_AT, phase),
            apart=1.0,
            bend=_at(_KNEE_AT, phase) * (0.4 + 0.6 * vigour),
            end=_at(_ANKLE_AT, phase),
            twist=6.0,
            toes=_at(_TOES_AT, phase) * vigour,
        )
        for phase in sides
    )
    turn = 2.0 * np.pi * np.array(sides)
    swing = -5.0 - 17.0 * vigour * np.cos(turn)
    bend = 22.0 - 11.0 * vigour * np.cos(turn - 0.5)
    arms = tuple(
        LimbAngles(swing=float(s), apart=7.0, bend=float(b), end=10.0, twist=-8.0)
        for s, b in zip(swing, bend, strict=True)
    )
    forward = float(np.cos(turn[0]))
    # The side of the swinging leg drops; the pelvis is highest over the standing leg.
    drop = float(3.0 * np.sin(turn[1] + 0.2))
    return Pose(
        (legs[0], legs[1]),
        (arms[0], arms[1]),
        pelvis=(4.0 * vigour * forward, drop, 0.0),
        trunk=(2.0, -0.3 * drop, 8.0 * vigour * forward),
        sway=-0.015 * float(np.sin(turn[1] + 0.2)),
    )


_REST = LimbAngles(swing=-3.0, apart=6.0, bend=16.0, end=10.0, twist=-10.0)
_PHONE = LimbAngles(swing=22.0, apart=8.0, bend=102.0, end=25.0, twist=-38.0)


def standing() -> Pose:
    """Weight on the right leg, the left knee bent, arms beside the body."""
    legs = (
        LimbAngles(swing=9.0, apart=6.0, bend=14.0, end=5.0, twist=16.0),
        LimbAngles(swing=-1.0, apart=-3.0, bend=1.0, end=2.0, twist=8.0),
    )
    arms = (LimbAngles(0.0, 5.0, 20.0, 10.0, -12.0), LimbAngles(-6.0, 7.0, 14.0, 10.0, -6.0))
    return Pose(
        legs, arms, (3.0, 4.0, 2.0), (0.0, -2.5, -2.0), (2.0, 14.0), sway=-0.03, planted=True
    )


def waiting() -> Pose:
    """Both feet on the ground, one hand before the body with a bent head, as with a telephone."""
    legs = (
        LimbAngles(swing=2.0, apart=4.0, bend=4.0, end=2.0, twist=12.0),
        LimbAngles(swing=0.0, apart=4.0, bend=2.0, end=2.0, twist=9.0),
    )
    return Pose(
        legs, (_REST, _PHONE), (0.0, -1.0, 1.0), (3.0, 1.0, -3.0), (22.0, -8.0), planted=True
    )


def sitting() -> Pose:
    """On a seat, with the hands on the thighs."""
    legs = (
        LimbAngles(swing=85.0, apart=7.0, bend=82.0, end=0.0, twist=2.0),
        LimbAngles(swing=84.0, apart=9.0, bend=92.0, end=9.0, twist=4.0),
    )
    arms = (LimbAngles(20.0, 9.0, 58.0, 20.0, -16.0), LimbAngles(17.0, 9.0, 62.0, 20.0, -18.0))
    return Pose(legs, arms, (0.0, 0.0, -8.0), (6.0, 0.0, 2.0), (4.0, 10.0), planted=True)


def rolling() -> Pose:
    """On the seat of a wheelchair, with the hands at its rims."""
    arms = (LimbAngles(-20.0, 14.0, 60.0), LimbAngles(-20.0, 14.0, 60.0))
    return replace(sitting(), arms=arms, trunk=(12.0, 0.0, 0.0), head=(2.0, 0.0))
