"""What people carry, push and sit in: bags, sticks, prams, wheelchairs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.assets.people.figure_pieces import Piece
from envgen_usd.assets.people.gait_angles import Pose
from envgen_usd.assets.people.garment_shapes import on_trunk, shoe, trunk_path
from envgen_usd.assets.people.lofted_forms import Loft, smoothed
from envgen_usd.assets.people.pose_skeleton import LEFT, RIGHT, Skeleton, reaching
from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.shapes.simple_solids import box, tube
from envgen_usd.assets.shapes.spoked_wheels import hoop, round_profile, spokes
from envgen_usd.models.array_types import FloatArray

Equipped = tuple[Skeleton, Sequence[Piece]]


def ground_of(skeleton: Skeleton) -> float:
    """Height of the lowest point of both shoes, metres."""
    return min(float(shoe(skeleton, side).mesh(8).points[:, 2].min()) for side in (LEFT, RIGHT))


def _bar(points: Sequence[Sequence[float] | FloatArray], radius: float, sides: int = 5) -> Mesh:
    return smoothed(tube(np.array(points, dtype=np.float64), np.full(len(points), radius), sides))


def _ribbon(points: FloatArray, outwards: FloatArray, wide: float) -> Loft:
    """A strap along points that lies on a body whose normals are `outwards`."""
    along = np.gradient(points, axis=0)
    left = np.cross(outwards, along)
    left = left / np.linalg.norm(left, axis=1, keepdims=True)
    sections = np.tile([wide, 0.004, 0.004, 3.0], (len(points), 1))
    return Loft(points, left, outwards, sections)


def _cushion(middle: FloatArray, frame: FloatArray, size: FloatArray, power: float = 4.0) -> Loft:
    """A body with rounded edges about a middle: half its size (3) along the columns of a frame."""
    share = np.array([-1.0, -0.97, -0.85, 0.0, 0.85, 0.97, 1.0])
    thick = np.array([0.82, 0.92, 1.0, 1.03, 1.0, 0.92, 0.82])
    ones = np.ones((7, 1))
    centres = middle + (share * size[2])[:, None] * frame[:, 2]
    sections = np.stack(
        [thick * size[1], thick * size[0], thick * size[0], np.full(7, power)], axis=1
    )
    return Loft(centres, ones * frame[:, 1], ones * frame[:, 0], sections)


def shoulder_bag(skeleton: Skeleton, _pose: Pose) -> Equipped:
    """A bag at the right hip, on a strap from the left shoulder."""
    heights = np.array([0.545, 0.62, 0.70, 0.77, 0.825, 0.846, 0.825, 0.77, 0.70, 0.62, 0.545])
    around = np.array([-72.0, -40.0, -8.0, 22.0, 44.0, 88.0, 138.0, 160.0, 188.0, 222.0, 254.0])
    points, outwards = on_trunk(skeleton, heights, around, 0.026)
    side, _ = on_trunk(skeleton, np.array([0.50]), np.array([-92.0]), 0.075)
    _, frames = trunk_path(skeleton, np.array([0.52]))
    bag = _cushion(side[0], frames[0], np.array([0.155, 0.055, 0.125]) * skeleton.build.scale)
    strap = _ribbon(points, outwards, 0.014)
    far = [bag.coarse(4, (1, 5))]
    return skeleton, [Piece("Bag", [bag.mesh(12), strap.mesh(4)], far, "leather_brown", "luggage")]


def backpack(skeleton: Skeleton, _pose: Pose) -> Equipped:
    """A backpack with two straps."""
    scale = skeleton.build.scale
    behind, _ = on_trunk(skeleton, np.array([0.715]), np.array([180.0]), 0.085 * scale)
    frame = skeleton.chest
    sack = _cushion(behind[0], frame, np.array([0.085, 0.150, 0.225]) * scale, 3.2)
    pocket = behind[0] - frame @ (np.array([0.080, 0.0, 0.085]) * scale)
    purse = _cushion(pocket, frame, np.array([0.045, 0.115, 0.105]) * scale, 3.4)
    straps = [_shoulder_strap(skeleton, sign) for sign in (1.0, -1.0)]
    near = [sack.mesh(12), purse.mesh(10), *(strap.mesh(4) for strap in straps)]
    far = [sack.coarse(4, (0, 3, 6))]
    return skeleton, [Piece("Bag", near, far, "cloth_charcoal", "luggage")]


def _shoulder_strap(skeleton: Skeleton, sign: float) -> Loft:
    heights = np.array([0.80, 0.826, 0.842, 0.828, 0.795, 0.745, 0.70, 0.665])
    around = sign * np.array([152.0, 138.0, 92.0, 52.0, 36.0, 36.0, 52.0, 86.0])
    points, outwards = on_trunk(skeleton, heights, around, 0.026)
    return _ribbon(points, outwards, 0.024)


def walking_stick(skeleton: Skeleton, pose: Pose) -> Equipped:
    """A stick in the right hand, which goes forwards with the left foot."""
    scale = skeleton.build.scale
    ground = ground_of(skeleton)
    swing = 0.0 if pose.planted else 0.0045 * (pose.legs[LEFT].swing - 5.0)
    root = skeleton.arms[RIGHT].points[0]
    handle = np.array([root[0] + 0.16 * scale + swing * 0.7, root[1] - 0.09, ground + 0.86 * scale])
    grip = handle + np.array([-0.075, 0.0, 0.015])
    limb = reaching(skeleton, RIGHT, grip)
    ahead = np.array([1.0, 0.0, -0.35])
    frame = _along(-ahead, limb.end[:, 1])
    held = replace(skeleton, arms=(skeleton.arms[LEFT], replace(limb, end=frame)))
    knob = handle + limb.points[2] - grip
    tip = np.array([knob[0] + 0.05 + 0.3 * swing, knob[1] - 0.03, ground])
    shaft = _bar([tip, knob], 0.011)
    crook = _bar([knob - [0.07, 0.0, 0.0], knob + np.array([0.04, 0.0, 0.0])], 0.014)
    far = [_bar([tip, knob], 0.013, 3)]
    return held, [Piece("Stick", [shaft, crook], far, "paint_brown", "luggage")]


def _along(up: FloatArray, left: FloatArray) -> FloatArray:
    """Axes (forward, left, up) as columns whose third is `up`."""
    third = up / np.linalg.norm(up)
    second = left - third * (left @ third)
    second = second / np.linalg.norm(second)
    return np.stack([np.cross(second, third), second, third], axis=1)


def telephone(skeleton: Skeleton, pose: Pose) -> Equipped:
    """A telephone in the raised right hand of somebody who waits."""
    limb = skeleton.arms[RIGHT]
    if pose.arms[RIGHT].bend < 90.0:
        return skeleton, []
    axes = _along(-(limb.end @ np.array([0.1, 0.0, -1.0])), limb.end[:, 0])
    middle = limb.points[2] + limb.end @ np.array([0.0, 0.022, -0.10]) * skeleton.build.scale
    slab = _cushion(middle, axes, np.array([0.005, 0.036, 0.072]), 6.0)
    return skeleton, [Piece("Phone", [slab.mesh(8)], [], "paint_black", "luggage")]


def pram(skeleton: Skeleton, _pose: Pose) -> Equipped:
    """A pram before the person, with both hands on its handle."""
    ground = ground_of(skeleton)
    base = np.array([0.0, 0.0, ground])
    held = skeleton
    for side, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
        wrist = base + np.array([0.37, 0.17 * sign, 1.035])
        limb = reaching(held, side, wrist, apart=0.6)
        end = _along(-np.array([1.0, -0.10 * sign, -0.25]), np.array([0.0, 0.0, 1.0]) * sign)
        arms = list(held.arms)
        arms[side] = replace(limb, end=end)
        held = replace(held, arms=(arms[LEFT], arms[RIGHT]))
    return held, _pram_pieces(base)


def _pram_pieces(base: FloatArray) -> list[Piece]:
    def at(x: float, y: float, z: float) -> list[float]:
        return [x, y, z + float(base[2])]

    ends = (1.0, -1.0)
    frame = [_bar([at(0.47, 0.23, 1.01), at(0.47, -0.23, 1.01)], 0.016)]
    for s in ends:
        frame.append(_bar([at(0.47, 0.23 * s, 1.01), at(0.62, 0.25 * s, 0.72),
                           at(1.28, 0.25 * s, 0.14)], 0.012))  # fmt: skip
        frame.append(_bar([at(0.62, 0.27 * s, 0.16), at(1.12, 0.25 * s, 0.66)], 0.012))
    frame += [
        _bar([at(x, 0.27, z), at(x, -0.27, z)], 0.010) for x, z in ((0.62, 0.16), (1.28, 0.14))
    ]
    wheels, discs = [], []
    for x, z, radius in ((0.62, 0.16, 0.16), (1.28, 0.12, 0.12)):
        for s in ends:
            middle = np.array(at(x, 0.28 * s, z))
            tyre = hoop(middle, radius - 0.018, round_profile(0.018, 5), 14)
            bars = spokes(middle, 0.015, radius - 0.02, 5, wide=0.012, thick=0.005)
            wheels += [smoothed(tyre), smoothed(bars)]
            discs.append(_disc(middle, radius))
    upright = np.eye(3)
    tub = _cushion(np.array(at(0.97, 0.0, 0.72)), upright, np.array([0.40, 0.21, 0.13]), 3.0)
    hood = _hood(np.array(at(0.86, 0.0, 0.78)))
    cover = _cushion(np.array(at(1.12, 0.0, 0.86)), upright, np.array([0.22, 0.185, 0.03]), 3.0)
    cloth = [tub.mesh(14), hood.mesh(12), cover.mesh(10)]
    far = [tub.coarse(4, (0, 6)), hood.coarse(4, (1, 3))]
    rear = _bar([at(0.47, 0.0, 1.01), at(0.75, 0.0, 0.60), at(1.2, 0.0, 0.2)], 0.02, 3)
    return [
        Piece("Pram", cloth, far, "cloth_charcoal", "luggage"),
        Piece("PramFrame", frame, [rear], "metal_dark", "luggage"),
        Piece("PramWheels", wheels, discs, "rubber", "wheel"),
    ]


def _hood(middle: FloatArray) -> Loft:
    """A folding hood: a quarter of a barrel across, open towards the front."""
    angle = np.radians([95.0, 120.0, 145.0, 168.0, 185.0])
    out = np.stack([np.cos(angle), np.zeros(5), np.sin(angle)], axis=1)
    centres = middle + 0.15 * out
    sections = np.tile([0.20, 0.16, 0.10, 3.0], (5, 1))
    return Loft(centres, np.tile([0.0, 1.0, 0.0], (5, 1)), out, sections)


def _disc(middle: FloatArray, radius: float) -> Mesh:
    """A wheel in the distance: a thin hexagonal drum."""
    ends = middle + np.array([[0.0, -0.015, 0.0], [0.0, 0.015, 0.0]])
    return tube(ends, np.full(2, radius * 0.97), 6)


def wheelchair(skeleton: Skeleton, pose: Pose) -> Equipped:
    """A wheelchair below a sitting person; straight elbows reach for the rims."""
    hips = skeleton.hips
    seat = float(hips[2]) - 0.105 * skeleton.build.scale
    ground = seat - 0.49
    held = skeleton
    if pose.arms[LEFT].swing < 0.0:
        for side, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
            limb = reaching(held, side, np.array([0.10, 0.31 * sign, ground + 0.66]), apart=0.9)
            arms = list(held.arms)
            arms[side] = limb
            held = replace(held, arms=(arms[LEFT], arms[RIGHT]))
    return held, _chair_pieces(seat, ground)


def _chair_pieces(seat: float, ground: float) -> list[Piece]:
    pads = [
        box((-0.20, -0.22, seat - 0.05), (0.24, 0.22, seat)),
        box((-0.235, -0.21, seat + 0.02), (-0.195, 0.21, seat + 0.42)),
    ]
    frame, tyres, rims, discs = [], [], [], []
    for s in (1.0, -1.0):
        y = 0.235 * s
        frame += [
            _bar([[-0.33, y, seat + 0.48], [-0.22, y, seat + 0.46], [-0.22, y, seat - 0.28]],
                 0.012),
            _bar([[-0.22, y, seat - 0.03], [0.26, y, seat - 0.03], [0.40, y * 0.8, ground + 0.10]],
                 0.012),
            _bar([[0.26, y, seat - 0.03], [0.26, y, ground + 0.14]], 0.011),
            _bar([[-0.20, y, seat + 0.20], [0.14, y, seat + 0.20], [0.17, y, seat - 0.02]], 0.012),
            smoothed(box((0.36, min(y * 0.8, y * 0.3), ground + 0.08),
                         (0.56, max(y * 0.8, y * 0.3), ground + 0.095))),
        ]  # fmt: skip
        middle = np.array([-0.10, 0.30 * s, ground + 0.30])
        tyres.append(smoothed(hoop(middle, 0.284, round_profile(0.016, 5), 24)))
        push = hoop(middle + np.array([0.0, 0.03 * s, 0.0]), 0.255, round_profile(0.009, 4), 18)
        rims += [smoothed(push), smoothed(spokes(middle, 0.03, 0.275, 14, wide=0.03, thick=0.002))]
        castor = np.array([0.28, y, ground + 0.085])
        tyres.append(smoothed(hoop(castor, 0.065, round_profile(0.020, 5), 10)))
        discs += [hoop(middle, 0.284, round_profile(0.018, 3), 8), _disc(castor, 0.08)]
    back = box((-0.22, -0.22, seat - 0.04), (-0.20, 0.22, seat + 0.42))
    base = box((-0.20, -0.22, seat - 0.06), (0.3, 0.22, seat - 0.01))
    return [
        Piece("Chair", pads, [back, base], "cloth_black", "luggage"),
        Piece("ChairFrame", [*frame, *rims], [], "metal_galvanised", "luggage"),
        Piece("ChairWheels", tyres, discs, "rubber", "wheel"),
    ]
