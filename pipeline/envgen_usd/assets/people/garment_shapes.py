"""Trunk, arms, legs, hands and shoes, bare or under garments that lie a little off the body."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.people import body_sizes
from envgen_usd.assets.people.lofted_forms import Loft, between, rotation
from envgen_usd.assets.people.pose_skeleton import Limb, Skeleton
from envgen_usd.assets.polygon_mesh import normalised
from envgen_usd.models.array_types import FloatArray

# Along a leg (1 at the knee, 2 at the ankle): half-width, depths to front and back, metres.
_LEG = np.array(
    [[-0.14, 0.060, 0.062, 0.070], [0.00, 0.084, 0.084, 0.094], [0.18, 0.086, 0.085, 0.088],
     [0.50, 0.074, 0.079, 0.074], [0.80, 0.061, 0.065, 0.059], [1.00, 0.056, 0.060, 0.052],
     [1.18, 0.053, 0.051, 0.058], [1.36, 0.055, 0.046, 0.067], [1.62, 0.043, 0.040, 0.050],
     [1.86, 0.034, 0.036, 0.040], [2.00, 0.034, 0.040, 0.042], [2.10, 0.036, 0.050, 0.044]]
)  # fmt: skip
# Along an arm (1 at the elbow, 2 at the wrist), in the same way.
_ARM = np.array(
    [[-0.34, 0.034, 0.046, 0.050], [-0.20, 0.042, 0.052, 0.055], [-0.04, 0.050, 0.058, 0.058],
     [0.25, 0.051, 0.058, 0.058], [0.80, 0.042, 0.045, 0.047],
     [1.00, 0.041, 0.042, 0.046], [1.20, 0.041, 0.046, 0.043], [1.50, 0.036, 0.040, 0.038],
     [1.80, 0.029, 0.032, 0.030], [2.00, 0.024, 0.030, 0.028]]
)  # fmt: skip


@dataclass(frozen=True)
class Cut:
    """How a garment hangs.

    Attributes:
        hem: Height of the lower edge of a top (share of the stature), or place along a leg or an
            arm (1 at knee or elbow, 2 at ankle or wrist).
        ease: Distance from the body, metres.
        width: Radius of the hem of a sleeve or leg, metres; a coat's, beyond the legs.
        collar: Height of the neckline, share of the stature.
    """

    hem: float
    ease: float
    width: float = 0.0
    collar: float = 0.868


def _trunk_rows(skeleton: Skeleton) -> FloatArray:
    """Height, half-width, depths to front and back, exponent of the bare trunk."""
    build = skeleton.build
    wide, waist, hips = build.shoulders, build.waist, build.hips
    bust, belly = build.bust, build.belly
    rows = np.array(
        [[0.470, hips * 0.86, 0.080, 0.098, 2.6], [0.500, hips * 0.98, 0.094, 0.122, 2.5],
         [0.535, hips, 0.102, 0.124, 2.4], [0.575, hips * 0.94, belly, 0.104, 2.3],
         [0.620, waist, belly, 0.094, 2.3], [0.660, waist * 1.02, belly * 0.98, 0.098, 2.3],
         [0.695, waist * 0.55 + wide * 0.40, bust * 0.92, 0.110, 2.3],
         [0.725, wide * 0.92, bust, 0.118, 2.3], [0.762, wide * 0.95, bust * 0.90, 0.122, 2.4],
         [0.795, wide * 0.98, 0.094, 0.114, 2.4], [0.813, wide * 0.92, 0.078, 0.104, 2.3],
         [0.827, wide * 0.76, 0.066, 0.094, 2.2], [0.839, wide * 0.58, 0.058, 0.082, 2.1],
         [0.850, 0.080, 0.055, 0.074, 2.0], [0.862, 0.063, 0.052, 0.067, 2.0],
         [0.876, 0.059, 0.055, 0.064, 2.0]]
    )  # fmt: skip
    rows[:, 1] *= build.scale * build.breadth
    rows[:, 2:4] *= build.scale * build.depth
    return rows


def trunk_path(skeleton: Skeleton, heights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middle (N x 3) and axes (N x 3 x 3) of the trunk at heights, shares of the stature."""
    share = np.clip((heights - 0.575) / 0.13, 0.0, 1.0)
    frames = between(skeleton.pelvis, skeleton.chest, share * share * (3.0 - 2.0 * share))
    # The middle is the integral of the upward axes, so that a bent back is a curve.
    fine = np.linspace(0.40, 0.90, 101)
    part = np.clip((fine - 0.575) / 0.13, 0.0, 1.0)
    axes = between(skeleton.pelvis, skeleton.chest, part * part * (3.0 - 2.0 * part))[..., 2]
    steps = (axes[1:] + axes[:-1]) / 2.0 * np.diff(fine)[:, None] * skeleton.build.stature
    line = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    start = np.array([np.interp(body_sizes.WAIST, fine, line[:, k]) for k in range(3)])
    middle = np.stack([np.interp(heights, fine, line[:, k] - start[k]) for k in range(3)], axis=1)
    return skeleton.waist + middle, frames


def on_trunk(
    skeleton: Skeleton, heights: FloatArray, around: FloatArray, lift: float
) -> tuple[FloatArray, FloatArray]:
    """Points (N x 3) a little off the trunk, and directions outwards.

    Args:
        skeleton: The body.
        heights: N, shares of the stature.
        around: N, angles from the front to the left, degrees.
        lift: Distance from the bare body, metres.
    """
    rows = _trunk_rows(skeleton)
    wide, ahead, behind, power = (np.interp(heights, rows[:, 0], rows[:, k]) for k in range(1, 5))
    cos, sin = np.cos(np.radians(around)), np.sin(np.radians(around))
    depth = np.where(cos > 0.0, ahead, behind)
    reach = (np.abs(sin / wide) ** power + np.abs(cos / depth) ** power) ** (-1.0 / power) + lift
    centres, frames = trunk_path(skeleton, heights)
    outwards = cos[:, None] * frames[..., 0] + sin[:, None] * frames[..., 1]
    # Shoulders look upwards, too.
    rise = np.interp(heights, [0.78, 0.845], [0.0, 1.2])[:, None] * frames[..., 2]
    return centres + reach[:, None] * outwards, normalised(outwards + rise)


def top(skeleton: Skeleton, cut: Cut) -> Loft:
    """A shirt, pullover or jacket; with a hem below 0.45 of the stature, a coat or a dress."""
    rows = _trunk_rows(skeleton)
    hem = max(cut.hem, 0.485)
    heights = np.concatenate([[hem - 1e-3, hem], rows[rows[:, 0] > hem + 0.012, 0]])
    heights = np.concatenate([heights[heights < cut.collar - 0.004], [cut.collar]])
    sections = np.stack([np.interp(heights, rows[:, 0], rows[:, k]) for k in range(1, 5)], axis=1)
    # Above the bust a garment lies on the body; below, it hangs from there.
    loose = cut.ease * np.interp(heights, [0.5, 0.7, 0.8, 0.87], [1.0, 1.0, 0.7, 0.5])
    sections[:, :3] += loose[:, None]
    sections[0, :3] -= 0.012
    sections[heights < 0.7, 1] = np.maximum(
        sections[heights < 0.7, 1], 0.80 * sections[heights > 0.7, 1].max()
    )
    centres, frames = trunk_path(skeleton, heights)
    upper = Loft(centres, frames[..., 1], frames[..., 0], sections)
    return upper if cut.hem >= 0.45 else _lengthened(skeleton, upper, cut)


def _lengthened(skeleton: Skeleton, upper: Loft, cut: Cut) -> Loft:
    """A top that goes on as a skirt around both legs."""
    drop = (0.485 - cut.hem) / body_sizes.THIGH + 0.15
    skirt = skirt_rings(skeleton, np.linspace(drop, 0.22, 6), cut)
    # The trunk widens towards the legs in three steps, so that the skirt has no edge.
    body = upper.sections[2:].copy()
    shares = np.array([[0.985], [0.95], [0.90]])
    body[:3, :3] = np.maximum(body[:3, :3], shares * skirt.sections[-1, :3])
    return Loft(
        np.concatenate([skirt.centres, upper.centres[2:]]),
        np.concatenate([skirt.left, upper.left[2:]]),
        np.concatenate([skirt.front, upper.front[2:]]),
        np.concatenate([skirt.sections, body]),
    )


def skirt_rings(skeleton: Skeleton, places: FloatArray, cut: Cut) -> Loft:
    """Rings around both legs at places along them, from the hem upwards."""
    paths = [_limb_path(leg, places) for leg in skeleton.legs]
    centres = (paths[0][0] + paths[1][0]) / 2.0
    front = normalised((paths[0][1] + paths[1][1])[..., 0])
    left = np.tile(skeleton.pelvis[:, 1], (len(places), 1))
    girth = skeleton.build.scale * skeleton.build.limbs
    radius = np.interp(places, _LEG[:, 0], _LEG[:, 2]) * girth + cut.ease
    radius = radius + cut.width * np.linspace(1.0, 0.2, len(places))
    apart = np.stack([path[0] - centres for path in paths])
    across = np.abs((apart * left).sum(axis=2)).max(axis=0) + radius
    along = (apart * front).sum(axis=2)
    depths = [along.max(axis=0) + radius * 1.12, -along.min(axis=0) + radius * 1.1]
    sections = np.stack([across, *depths, np.full(len(places), 2.3)], axis=1)
    # The first ring is the edge of the hem, which turns inwards.
    rows = np.array([0, *range(len(places))])
    sections = sections[rows]
    sections[0, :3] -= 0.015
    centres = centres[rows]
    centres[0] += 0.004 * skeleton.pelvis[:, 2]
    return Loft(centres, left[rows], front[rows], sections)


def seat(skeleton: Skeleton, cut: Cut, waist: float = 0.60) -> Loft:
    """Hips under trousers, from the crotch to the waist."""
    rows = _trunk_rows(skeleton)
    heights = np.array([0.462, 0.468, 0.488, 0.51, 0.54, 0.57, waist - 0.004, waist])
    sections = np.stack([np.interp(heights, rows[:, 0], rows[:, k]) for k in range(1, 5)], axis=1)
    sections[:, :3] += min(cut.ease, 0.008)
    sections[:4, 0] *= [0.30, 0.45, 0.72, 0.92]
    sections[:4, 1] *= [0.40, 0.60, 0.78, 0.90]
    sections[:3, 2] *= [0.5, 0.75, 0.95]
    sections[-1, :3] -= 0.01
    centres, frames = trunk_path(skeleton, heights)
    return Loft(centres, frames[..., 1], frames[..., 0], sections)


def _limb_path(limb: Limb, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points (N x 3) and axes (N x 3 x 3) along a limb: 0 root, 1 middle joint, 2 end."""
    root, middle, end = limb.points
    first = root + places[:, None] * (middle - root)
    second = middle + (places[:, None] - 1.0) * (end - middle)
    line = np.where(places[:, None] < 1.0, first, second)
    share = np.clip((places - 0.8) / 0.4, 0.0, 1.0)
    return line, between(limb.upper, limb.lower, share)


def _limb(
    limb: Limb, table: FloatArray, places: FloatArray, girth: float, loose: FloatArray
) -> Loft:
    sections = np.stack([np.interp(places, table[:, 0], table[:, k]) for k in (1, 2, 3)], axis=1)
    sections = sections * girth + loose[:, None]
    centres, frames = _limb_path(limb, places)
    sections = np.column_stack([sections, np.full(len(places), 2.1)])
    return Loft(centres, frames[..., 1], frames[..., 0], sections)


def leg(skeleton: Skeleton, side: int, cut: Cut) -> Loft:
    """A leg of trousers or shorts down to the hem; it hides in the hips above."""
    girth = skeleton.build.scale * skeleton.build.limbs
    places = _LEG[_LEG[:, 0] < cut.hem - 0.05, 0]
    if cut.hem > 1.5:
        # Cloth that meets the shoe falls in folds.
        places = np.concatenate([places[places < 1.7], [1.74, 1.82, 1.89, 1.95]])
    places = np.concatenate([places, [cut.hem, cut.hem + 0.005]])
    bare = np.interp(places, _LEG[:, 0], _LEG[:, 1]) * girth
    hang = np.interp(places, [0.3, 1.0, cut.hem], [0.0, 0.45, 1.0]) if cut.hem > 1.2 else 0.0
    loose = cut.ease + hang * np.maximum(cut.width * girth - bare - cut.ease, 0.0)
    loose = loose + np.where(np.isin(places, [1.74, 1.89]), -0.003, 0.0)
    loose = loose + np.where(np.isin(places, [1.82, 1.95]), 0.003, 0.0)
    loose = np.where(places > cut.hem, loose - 0.012, loose)
    loose = loose * np.interp(places, [-0.14, 0.25], [0.1, 1.0])
    return _limb(skeleton.legs[side], _LEG, places, girth, loose)


def bare_leg(skeleton: Skeleton, side: int, start: float) -> Loft:
    """A bare leg, or one in tights, from a place along it to the foot."""
    girth = skeleton.build.scale * skeleton.build.limbs
    places = np.concatenate([[start], _LEG[_LEG[:, 0] > start + 0.08, 0]])
    return _limb(skeleton.legs[side], _LEG, places, girth, np.zeros(len(places)))


def _arm(skeleton: Skeleton, side: int, places: FloatArray, loose: FloatArray) -> Loft:
    """An arm whose root lies in the shoulder, inwards and above the joint."""
    girth = skeleton.build.scale * skeleton.build.limbs
    loft = _limb(skeleton.arms[side], _ARM, places, girth, loose)
    limb, sign = skeleton.arms[side], (1.0 if side == 0 else -1.0)
    length = body_sizes.UPPER_ARM * skeleton.build.stature
    # Above the joint, the line turns inwards in an arc.
    turn = np.radians(75.0) * np.clip((0.12 - places) / 0.42, 0.0, 1.0)
    beyond = np.minimum(places - 0.12, 0.0) * length
    inwards = -sign * np.sin(turn * 0.62)[:, None] * skeleton.chest[:, 1]
    upwards = np.cos(turn * 0.62)[:, None] * limb.upper[:, 2]
    start = limb.points[0] - 0.12 * length * limb.upper[:, 2]
    root = start - beyond[:, None] * (inwards + upwards)
    centres = np.where(places[:, None] < 0.12, root, loft.centres)
    tilt = (turn * sign)[:, None]
    left = np.cos(tilt) * loft.left + np.sin(tilt) * limb.upper[:, 2]
    return Loft(centres, left, loft.front, loft.sections)


def sleeve(skeleton: Skeleton, side: int, cut: Cut) -> Loft:
    """A sleeve from the shoulder to the cuff."""
    girth = skeleton.build.scale * skeleton.build.limbs
    places = _ARM[_ARM[:, 0] < cut.hem - 0.06, 0]
    places = np.concatenate([places, [cut.hem, cut.hem + 0.01]])
    bare = np.interp(places, _ARM[:, 0], _ARM[:, 1]) * girth
    hang = np.interp(places, [0.4, cut.hem], [0.0, 1.0])
    loose = cut.ease + hang * np.maximum(cut.width * girth - bare - cut.ease, 0.0)
    loose = loose * np.interp(places, [-0.34, 0.0], [0.4, 1.0])
    loose = np.where(places > cut.hem, loose - 0.010, loose)
    return _arm(skeleton, side, places, loose)


def bare_arm(skeleton: Skeleton, side: int, start: float) -> Loft:
    """A bare arm from a place along it to the wrist."""
    places = np.concatenate([[start], _ARM[_ARM[:, 0] > start + 0.08, 0]])
    return _arm(skeleton, side, places, np.zeros(len(places)))


def hand(skeleton: Skeleton, side: int, grip: float = 0.35) -> tuple[Loft, Loft]:
    """A hand with its fingers together, and its thumb.

    Args:
        skeleton: The body.
        side: Number of the arm.
        grip: Bend of the fingers: 0 for a flat hand, 1 for a fist.
    """
    size = skeleton.build.stature * body_sizes.HAND / 0.19
    sign = 1.0 if side == 0 else -1.0
    limb = skeleton.arms[side]
    wrist, axes = limb.points[2], limb.end
    down = np.array([-0.02, 0.02, 0.055, 0.088, 0.122, 0.152, 0.172])
    thick = np.array([0.020, 0.017, 0.017, 0.015, 0.013, 0.011, 0.004])
    broad = np.array([0.026, 0.031, 0.041, 0.041, 0.038, 0.032, 0.012])
    # Beyond the knuckles, the fingers turn about them towards the palm.
    bend = np.radians(150.0) * grip * np.clip((down - 0.085) / 0.09, 0.0, 1.0)
    steps = np.diff(down, prepend=down[0])
    inward, drop = np.cumsum(np.sin(bend) * steps), down[0] + np.cumsum(np.cos(bend) * steps)
    middle = np.stack([np.zeros(7), -sign * inward, -drop], axis=1) * size
    out = np.stack([np.zeros(7), np.cos(bend), -sign * np.sin(bend)], axis=1)
    ones = np.ones((7, 1))
    sections = np.stack([thick, broad, broad, np.full(7, 2.4)], axis=1) * [size, size, size, 1.0]
    fingers = Loft(wrist + middle @ axes.T, out @ axes.T, ones * axes[:, 0], sections)
    path = np.array([[0.012, 0.0, -0.015], [0.030, -0.008 * sign, -0.040],
                     [0.044, -0.016 * sign, -0.066], [0.046, -0.024 * sign, -0.092],
                     [0.045, -0.027 * sign, -0.099]]) * size  # fmt: skip
    radius = np.array([0.010, 0.014, 0.012, 0.010, 0.004]) * size
    ones = np.ones((5, 1))
    round_ = np.stack([radius, radius, radius, np.full(5, 2.0)], axis=1)
    thumb = Loft(wrist + path @ axes.T, ones * axes[:, 1], ones * axes[:, 0], round_)
    return fingers, thumb


# Along a shoe from the ankle's axis: half-width, top and underside, metres.
_SHOE = np.array(
    [[-0.076, 0.010, 0.052, 0.016], [-0.070, 0.026, 0.082, 0.003], [-0.045, 0.034, 0.100, 0.0],
     [0.000, 0.036, 0.106, 0.0], [0.055, 0.039, 0.080, 0.0], [0.118, 0.047, 0.059, 0.0],
     [0.160, 0.046, 0.049, 0.002], [0.190, 0.034, 0.042, 0.006], [0.206, 0.014, 0.033, 0.014]]
)  # fmt: skip
_BALL = 0.115
"""Distance of the joint of the toes from the ankle's axis, metres."""


def shoe(skeleton: Skeleton, side: int) -> Loft:
    """A shoe whose toes bend."""
    limb, size = skeleton.legs[side], skeleton.build.scale
    axes, ankle = limb.end, limb.points[2]
    x, wide, high, low = (_SHOE * size).T
    middle = low + 0.42 * (high - low)
    sole = body_sizes.ANKLE * skeleton.build.stature + 0.018
    local = np.stack([x, np.zeros(len(x)), middle - sole], axis=1)
    up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    pivot = np.array([_BALL * size, 0.0, 0.01 - sole])
    bent = rotation(1, -limb.toes)
    toes = x > _BALL * size
    local[toes] = pivot + (local[toes] - pivot) @ bent.T
    up[toes] = bent[:, 2]
    sections = np.stack([wide, high - middle, middle - low, np.full(len(x), 3.0)], axis=1)
    left = np.tile(axes[:, 1], (len(x), 1))
    return Loft(ankle + local @ axes.T, left, up @ axes.T, sections)
