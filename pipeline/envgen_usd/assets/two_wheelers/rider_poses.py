"""Riders: bodies whose hands reach the handlebar and whose feet reach pedals or rests."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.people.body_sizes import ANKLE
from envgen_usd.assets.people.figure_models import Figure, body_pieces
from envgen_usd.assets.people.figure_pieces import Piece
from envgen_usd.assets.people.gait_angles import LimbAngles, Pose
from envgen_usd.assets.people.lofted_forms import rotation
from envgen_usd.assets.people.pose_skeleton import (
    LEFT,
    RIGHT,
    Limb,
    Skeleton,
    posed,
    reaching,
    stepping,
)
from envgen_usd.models.array_types import FloatArray

_SOLE = 0.018
"""Thickness of a sole, metres."""
_BALL = 0.105
"""Distance of the ball of the foot from the ankle's axis, metres for 1.75 m."""
_UNDER = 0.095
"""Height of the hip joints above the seat, metres for 1.75 m."""


@dataclass(frozen=True)
class RiderSeat:
    """Where a rider touches a vehicle, metres.

    Attributes:
        seat: Middle of the top of the seat (3).
        grips: Left and right grip (2 x 3).
        feet: Left and right place below the balls of the feet (2 x 3).
        lean: Lean of the trunk forwards, degrees.
        tilt: Tilt of the feet, toes down, degrees: left and right.
        apart: Share to which elbows point away from the body.
    """

    seat: FloatArray
    grips: FloatArray
    feet: FloatArray
    lean: float
    tilt: tuple[float, float] = (0.0, 0.0)
    apart: float = 0.5


def rider_pieces(figure: Figure, place: RiderSeat) -> tuple[Piece, ...]:
    """Body and clothes of a rider, labelled as a rider."""
    return body_pieces(figure, riding(figure, place), of_class="rider")


def riding(figure: Figure, place: RiderSeat) -> Skeleton:
    """The skeleton of a rider."""
    build = figure.build
    straight = (LimbAngles(apart=8.0), LimbAngles(apart=8.0))
    tilt = 0.35 * place.lean
    pose = Pose(straight, straight, (0.0, 0.0, tilt), (place.lean - tilt / 2, 0.0, 0.0), (4.0, 0.0))
    skeleton = posed(build, pose)
    hips = place.seat + np.array([0.0, 0.0, _UNDER * build.scale])
    skeleton = _shifted(skeleton, hips - skeleton.hips)
    legs = tuple(
        _foot_on(skeleton, side, place.feet[side], place.tilt[side]) for side in (LEFT, RIGHT)
    )
    skeleton = replace(skeleton, legs=(legs[0], legs[1]))
    arms = tuple(_hand_at(skeleton, side, place) for side in (LEFT, RIGHT))
    return replace(skeleton, arms=(arms[0], arms[1]))


def _shifted(skeleton: Skeleton, offset: FloatArray) -> Skeleton:
    def limb(each: Limb) -> Limb:
        return replace(each, points=each.points + offset)

    legs, arms = (tuple(map(limb, pair)) for pair in (skeleton.legs, skeleton.arms))
    return replace(
        skeleton, hips=skeleton.hips + offset, waist=skeleton.waist + offset,
        neck=skeleton.neck + offset, skull=skeleton.skull + offset,
        legs=(legs[0], legs[1]), arms=(arms[0], arms[1]),
    )  # fmt: skip


def _foot_on(skeleton: Skeleton, side: int, ball: FloatArray, tilt: float) -> Limb:
    build = skeleton.build
    foot = rotation(1, tilt)
    sole = ANKLE * build.stature + _SOLE
    ankle = ball + foot @ np.array([-_BALL * build.scale, 0.0, sole])
    return stepping(skeleton, side, ankle, foot)


def _hand_at(skeleton: Skeleton, side: int, place: RiderSeat) -> Limb:
    """The arm whose fist is around a grip."""
    scale, grip = skeleton.build.scale, place.grips[side]
    shoulder = skeleton.arms[side].points[0]
    line = (grip - shoulder) / np.linalg.norm(grip - shoulder)
    wrist = grip - 0.075 * scale * line + [0.0, 0.0, 0.022 * scale]
    limb = reaching(skeleton, side, wrist, apart=place.apart)
    up = -(line + np.array([0.0, 0.0, -0.15]))
    up = up / np.linalg.norm(up)
    # Palms look down around the bar: the thumb's side points inwards.
    inwards = np.array([0.0, -1.0 if side == LEFT else 1.0, 0.0])
    forward = inwards - up * (inwards @ up)
    forward = forward / np.linalg.norm(forward)
    return replace(limb, end=np.stack([forward, np.cross(up, forward), up], axis=1))
