"""A skeleton in a pose, by forward kinematics."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.people import body_sizes
from envgen_usd.assets.people.body_sizes import Build
from envgen_usd.assets.people.gait_angles import LimbAngles, Pose
from envgen_usd.assets.people.lofted_forms import rotation
from envgen_usd.models.array_types import FloatArray

LEFT, RIGHT = 0, 1
_HIP_APART = 0.049
"""Half the distance of the hip joints, share of the stature."""


@dataclass(frozen=True)
class Limb:
    """Joints of an arm or a leg.

    Attributes:
        points: 3 x 3, root, middle and end joint, metres.
        upper: 3 x 3, axes (forward, left, up) of the upper part as columns.
        lower: 3 x 3, of the lower part.
        end: 3 x 3, of the hand or the foot.
        toes: Bend of the toes, degrees.
    """

    points: FloatArray
    upper: FloatArray
    lower: FloatArray
    end: FloatArray
    toes: float = 0.0


@dataclass(frozen=True)
class Skeleton:
    """Joints of a body with the middle of its hips above the origin.

    Attributes:
        build: The body.
        pelvis: 3 x 3, axes (forward, left, up) as columns.
        chest: 3 x 3.
        head: 3 x 3.
        hips: Middle of the hip joints (3), metres.
        waist: 3, where the trunk bends.
        neck: 3, root of the neck.
        skull: 3, middle of the head.
        legs: Left and right.
        arms: Left and right.
    """

    build: Build
    pelvis: FloatArray
    chest: FloatArray
    head: FloatArray
    hips: FloatArray
    waist: FloatArray
    neck: FloatArray
    skull: FloatArray
    legs: tuple[Limb, Limb]
    arms: tuple[Limb, Limb]

    def of_chest(self, forward: float, left: float, height: float) -> FloatArray:
        """A point of the chest (3): metres from the spine, and height as a share of the stature."""
        up = (height - body_sizes.WAIST) * self.build.stature
        point: FloatArray = self.waist + self.chest @ np.array([forward, left, up])
        return point


def posed(build: Build, pose: Pose) -> Skeleton:
    """The skeleton of a body in a pose; its hips are as high as when it stands upright."""
    turn, drop, tilt = pose.pelvis
    pelvis = rotation(2, -turn) @ rotation(0, -drop) @ rotation(1, tilt)
    lean, side, twist = pose.trunk
    chest = rotation(2, twist - turn) @ rotation(0, -side) @ rotation(1, lean + tilt / 2)
    chest = chest @ rotation(1, build.stoop)
    nod, look = pose.head
    # Eyes stay level unless the head nods; a bent back takes the head half the way along.
    head = rotation(2, look) @ rotation(1, nod + 0.35 * build.stoop)
    height = build.stature
    hips = np.array([0.0, pose.sway, body_sizes.HIP * height])
    waist = hips + pelvis @ np.array([0.0, 0.0, (body_sizes.WAIST - body_sizes.HIP) * height])
    up = (body_sizes.NECK - body_sizes.WAIST) * height
    neck = waist + chest @ np.array([-0.012 * build.scale, 0.0, up])
    rise = (body_sizes.HEAD - body_sizes.NECK) * height
    neck_axis = chest @ rotation(1, 14.0 - 0.3 * build.stoop) @ np.array([0.0, 0.0, 0.45 * rise])
    skull = neck + neck_axis + head @ np.array([0.012, 0.0, 0.55 * rise])
    apart = np.array([0.0, _HIP_APART * height, 0.0])
    legs = tuple(
        _leg(build, angles, hips + pelvis @ (apart * sign), pelvis, sign)
        for angles, sign in zip(pose.legs, (1.0, -1.0), strict=True)
    )
    skeleton_base = (build, pelvis, chest, head, hips, waist, neck, skull, (legs[0], legs[1]))
    reach = (body_sizes.SHOULDER - body_sizes.WAIST) * height
    wide = build.shoulders * build.scale
    arms = tuple(
        _arm(build, angles, waist + chest @ np.array([-0.01, wide * sign, reach]), chest, sign)
        for angles, sign in zip(pose.arms, (1.0, -1.0), strict=True)
    )
    skeleton = Skeleton(*skeleton_base, (arms[0], arms[1]))
    return _planted(skeleton) if pose.planted else skeleton


def _planted(skeleton: Skeleton) -> Skeleton:
    """The skeleton with both soles level at the height of the higher one; the knees give way."""
    level = max(float(leg.points[2, 2]) for leg in skeleton.legs)
    legs = []
    for side, leg in enumerate(skeleton.legs):
        ankle = np.array([*leg.points[2, :2], level])
        forward = leg.end[:, 0] * [1.0, 1.0, 0.0]
        legs.append(
            stepping(
                skeleton,
                side,
                ankle,
                _axes(np.array([0.0, 0.0, 1.0]), np.array([-forward[1], forward[0], 0.0])),
            )
        )
    return replace(skeleton, legs=(legs[0], legs[1]))


def _leg(build: Build, angles: LimbAngles, root: FloatArray, base: FloatArray, sign: float) -> Limb:
    upper = base @ rotation(1, -angles.swing) @ rotation(0, sign * angles.apart)
    upper = upper @ rotation(2, sign * angles.twist)
    lower = upper @ rotation(1, angles.bend)
    foot = lower @ rotation(1, -angles.end)
    knee = root - body_sizes.THIGH * build.stature * upper[:, 2]
    ankle = knee - body_sizes.SHANK * build.stature * lower[:, 2]
    return Limb(np.stack([root, knee, ankle]), upper, lower, foot, angles.toes)


def _arm(build: Build, angles: LimbAngles, root: FloatArray, base: FloatArray, sign: float) -> Limb:
    upper = base @ rotation(1, -angles.swing) @ rotation(0, sign * angles.apart)
    upper = upper @ rotation(2, sign * angles.twist)
    lower = upper @ rotation(1, -angles.bend)
    hand = lower @ rotation(0, -sign * angles.end)
    elbow = root - body_sizes.UPPER_ARM * build.stature * upper[:, 2]
    wrist = elbow - body_sizes.FOREARM * build.stature * lower[:, 2]
    return Limb(np.stack([root, elbow, wrist]), upper, lower, hand)


def reaching(skeleton: Skeleton, side: int, wrist: FloatArray, *, apart: float = 0.25) -> Limb:
    """The arm whose wrist is at a place, with its elbow down and a little out.

    Args:
        skeleton: The body.
        side: `LEFT` or `RIGHT`.
        wrist: 3, metres; farther than the arm is long, the arm is straight.
        apart: Share of the elbow's direction that points away from the body.
    """
    height = skeleton.build.stature
    first, second = body_sizes.UPPER_ARM * height, body_sizes.FOREARM * height
    sign = 1.0 if side == LEFT else -1.0
    pole = skeleton.chest @ np.array([-0.35, sign * apart, -1.0])
    root = skeleton.arms[side].points[0]
    return bent_limb(root, wrist, (first, second), pole, forward=False)


def stepping(skeleton: Skeleton, side: int, ankle: FloatArray, foot: FloatArray) -> Limb:
    """The leg whose ankle is at a place, with its knee forwards.

    Args:
        skeleton: The body.
        side: `LEFT` or `RIGHT`.
        ankle: 3, metres.
        foot: 3 x 3, axes of the foot.
    """
    height = skeleton.build.stature
    lengths = body_sizes.THIGH * height, body_sizes.SHANK * height
    sign = 1.0 if side == LEFT else -1.0
    pole = skeleton.pelvis @ np.array([1.0, 0.15 * sign, 0.1])
    root = skeleton.legs[side].points[0]
    limb = bent_limb(root, ankle, lengths, pole, forward=True)
    return Limb(limb.points, limb.upper, limb.lower, foot)


def bent_limb(
    root: FloatArray,
    end: FloatArray,
    lengths: tuple[float, float],
    pole: FloatArray,
    *,
    forward: bool,
) -> Limb:
    """Two parts between places; the middle joint lies towards `pole` (law of cosines).

    Args:
        root: 3, metres.
        end: 3, metres.
        lengths: Of both parts, metres.
        pole: 3, direction of the middle joint.
        forward: True if it points forwards, as knees do; elbows point backwards.
    """
    first, second = lengths
    line = end - root
    reach = float(np.clip(np.linalg.norm(line), abs(first - second) + 1e-3, first + second - 1e-3))
    along = line / np.linalg.norm(line)
    aside = pole - along * (pole @ along)
    aside = aside / np.linalg.norm(aside)
    cosine = (first**2 + reach**2 - second**2) / (2 * first * reach)
    middle = root + first * (cosine * along + np.sqrt(max(0.0, 1.0 - cosine**2)) * aside)
    tip = root + reach * along
    # Both parts hinge about the normal of their plane, which is the body's left.
    hinge = np.cross(along, aside) if not forward else np.cross(aside, along)
    return Limb(
        np.stack([root, middle, tip]),
        _axes(root - middle, hinge),
        _axes(middle - tip, hinge),
        _axes(middle - tip, hinge),
    )


def _axes(up: FloatArray, left: FloatArray) -> FloatArray:
    """Axes as columns: forward, left, up."""
    up, left = up / np.linalg.norm(up), left / np.linalg.norm(left)
    return np.stack([np.cross(left, up), left, up], axis=1)
