"""Broad-leaved trees: trunk, limbs, twigs, and cards with the leaves of a twig."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge, normalised
from envgen_usd.assets.shapes.simple_solids import tube, upright_size
from envgen_usd.models.array_types import FloatArray

GOLDEN_ANGLE = 2.399963
"""Angle between successive elements that spread evenly around an axis, radians."""


@dataclass(frozen=True)
class Crown:
    """The shape of a broad-leaved tree; lengths in metres.

    Attributes:
        height: Height of the tree.
        width: Diameter of the crown.
        bottom: Height of the crown's lower edge.
        widest: Height of the crown's largest diameter.
        top: Exponent of the outline above the largest diameter; a larger value gives a more pointed
            crown.
        tufts: Number of tufts of leaves.
    """

    height: float
    width: float
    bottom: float
    widest: float
    top: float
    tufts: int

    def radius(self, z: FloatArray) -> FloatArray:
        """Radius of the crown at a height."""
        above = np.clip((z - self.widest) / (self.height - self.widest), 0.0, 1.0)
        below = np.clip((self.widest - z) / (self.widest - self.bottom), 0.0, 1.0)
        upper: FloatArray = np.sqrt(np.maximum(1 - above**self.top, 0.0))
        lower: FloatArray = np.sqrt(np.maximum(1 - below**2.4, 0.0))
        radius: FloatArray = np.minimum(upper, lower) * (self.width / 2)
        return radius


CROWNS = {
    "round": Crown(10.0, 6.4, 2.3, 5.6, 2.0, 86),
    "tall": Crown(10.0, 5.0, 1.9, 4.6, 1.5, 80),
    "wide": Crown(10.0, 7.2, 3.0, 6.4, 2.3, 92),
}


def broadleaf(crown: Crown, rng: np.random.Generator) -> Model:
    """A broad-leaved tree with its base at the origin, and a simpler proxy."""
    tufts = _tufts(crown, crown.tufts, rng)
    trunk = _trunk(crown, rng)
    limbs = _limbs(crown, trunk, rng)
    wood = merge([_bark(trunk, crown, 7), *(_limb_mesh(limb) for limb in limbs)])
    leaves = _leaf_cards(crown, tufts, 7, (0.40, 0.62), rng)
    far = _leaf_cards(crown, _tufts(crown, 22, rng), 2, (1.05, 1.45), rng)
    parts = (
        Part("Wood", wood, "bark", "trunk"),
        Part("Leaves", leaves, "leaves", "crown", double_sided=True),
        Part("Twigs", _twigs(tufts, trunk, limbs, rng), "bark", "trunk"),
        Part("WoodProxy", _bark(trunk[::7], crown, 4), "bark", "trunk", proxy_of="Wood"),
        Part("LeavesProxy", far, "leaves", "crown", double_sided=True, proxy_of="Leaves"),
    )
    return Model(parts, upright_size(wood, leaves))


def _tufts(crown: Crown, count: int, rng: np.random.Generator) -> FloatArray:
    """Centres of tufts, N x 3, mostly in the outer part of the crown."""
    order = np.arange(count)
    low, high = crown.bottom + 0.35, crown.height - 0.55
    z = low + (high - low) * (order + 0.5) / count + rng.normal(0, 0.15, count)
    bearing = order * GOLDEN_ANGLE + rng.normal(0, 0.25, count)
    inward = np.where(order % 4 == 0, 0.42, rng.uniform(0.72, 0.95, count))
    radius = np.maximum(crown.radius(z) - 0.55, 0.05) * inward
    lumps = 1 + 0.10 * np.sin(3 * bearing + 1.1 * z) + 0.07 * np.sin(2 * bearing - 1.7 * z)
    reach = radius * lumps
    return np.stack([np.cos(bearing) * reach, np.sin(bearing) * reach, z], axis=1)


def _trunk(crown: Crown, rng: np.random.Generator) -> FloatArray:
    """Axis of the trunk, 8 x 3, slightly bent."""
    z = np.linspace(0.0, crown.height * 0.80, 8)
    sway = np.cumsum(rng.normal(0, 0.05, (8, 2)), axis=0) * (z / z[-1])[:, None]
    return np.concatenate([sway, z[:, None]], axis=1)


def _bark(axis: FloatArray, crown: Crown, sides: int) -> Mesh:
    """Surface of the trunk around its axis, thicker at the base."""
    share = axis[:, 2] / (crown.height * 0.80)
    girth = 0.19 * np.maximum(1 - share, 0.0) ** 0.8 + 0.025
    girth[0] *= 1.45
    return tube(axis, girth, sides, caps=False)


def _limbs(crown: Crown, trunk: FloatArray, rng: np.random.Generator) -> list[FloatArray]:
    """Main branches, each 5 x 3: out of the trunk, then bending upwards."""
    limbs = []
    low, high = crown.bottom * 0.85, crown.height * 0.66
    t = np.linspace(0.0, 1.0, 5)
    for index, foot_z in enumerate(np.linspace(low, high, 8)):
        foot = np.array([np.interp(foot_z, trunk[:, 2], trunk[:, axis]) for axis in range(3)])
        bearing = index * GOLDEN_ANGLE + rng.normal(0, 0.2)
        end_z = min(foot_z + rng.uniform(1.3, 2.2), crown.height - 0.9)
        out = 0.72 * float(crown.radius(np.array([end_z]))[0]) * t**0.85
        rise = (end_z - foot_z) * t**1.25
        limb = foot + np.stack([np.cos(bearing) * out, np.sin(bearing) * out, rise], axis=1)
        limb[1:] += rng.normal(0, 0.05, (4, 3))
        limbs.append(limb)
    return limbs


def _limb_mesh(limb: FloatArray) -> Mesh:
    return tube(limb, np.linspace(0.085, 0.03, len(limb)), 4, caps=False)


def _twigs(
    tufts: FloatArray, trunk: FloatArray, limbs: list[FloatArray], rng: np.random.Generator
) -> Mesh:
    """Twigs of a leafless tree: a fork at the place of each tuft."""
    joints = np.concatenate([limb[2:] for limb in limbs] + [trunk[4:]])
    pieces = []
    for tuft in tufts:
        distance = np.linalg.norm(joints - tuft, axis=1)
        distance += 2.0 * np.maximum(joints[:, 2] - tuft[2], 0.0)
        foot = joints[int(np.argmin(distance))]
        middle = (foot + tuft) / 2 + rng.normal(0, 0.08, 3) + [0.0, 0.0, 0.06]
        pieces.append(tube(np.stack([foot, middle, tuft]), np.array([0.030, 0.018, 0.010]), 3,
                           caps=False))  # fmt: skip
        for _ in range(3):
            tip = tuft + normalised(tuft - foot) * 0.45 + rng.normal(0, 0.28, 3)
            pieces.append(tube(np.stack([tuft, tip]), np.array([0.010, 0.004]), 3, caps=False))
    return merge(pieces)


def _leaf_cards(  # noqa: PLR0913, PLR0917 - where leaves are and how large
    crown: Crown,
    tufts: FloatArray,
    each: int,
    half_side: tuple[float, float],
    rng: np.random.Generator,
    spread: float = 1.0,
) -> Mesh:
    """Square cards around each tuft; their normals shade the crown as a soft body."""
    count = len(tufts) * each
    offset = normalised(rng.normal(size=(count, 3))) * rng.uniform(0.1, 1.0, (count, 1)) ** 0.5
    centre = np.repeat(tufts, each, axis=0) + offset * np.array([0.62, 0.62, 0.48]) * spread
    middle = np.array([0.0, 0.0, crown.bottom + 0.35 * (crown.height - crown.bottom)])
    outward = normalised(centre - middle + np.array([0.0, 0.0, 0.3]))
    soft = normalised(outward + 0.55 * offset)
    facing = normalised(soft + rng.normal(0, 0.55, (count, 3)))
    facing *= np.where((facing * soft).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    side = normalised(np.cross(facing, rng.normal(size=(count, 3))))
    half = rng.uniform(*half_side, (count, 1))
    return _cards(centre, side * half, np.cross(facing, side) * half, soft)


def _cards(centre: FloatArray, side: FloatArray, up: FloatArray, normal: FloatArray) -> Mesh:
    """Quads with the whole texture, from centre and half edges, N x 3."""
    corners = np.stack(
        [centre - side - up, centre + side - up, centre + side + up, centre - side + up], axis=1
    )
    count = len(centre)
    bend = normalised(corners - centre[:, None]) * 0.35
    normals = normalised(normal[:, None] + bend)
    uv = np.tile([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], (count, 1))
    points = corners.reshape(-1, 3)
    return Mesh(points, np.full(count, 4), np.arange(4 * count), normals.reshape(-1, 3), uv)


def bush(rng: np.random.Generator) -> Model:
    """A bush of 1.5 m with leaves down to the ground."""
    count = 26
    height, bearing = rng.uniform(0.18, 1.15, count), np.arange(count) * GOLDEN_ANGLE
    reach = 0.62 * np.sqrt(np.maximum(1 - (height / 1.35) ** 2, 0.0)) * rng.uniform(0.5, 1.0, count)
    tufts = np.stack([np.cos(bearing) * reach, np.sin(bearing) * reach, height], axis=1)
    crown = Crown(1.5, 1.5, 0.0, 0.5, 2.0, count)
    leaves = _leaf_cards(crown, tufts, 7, (0.17, 0.27), rng, 0.45)
    points = np.maximum(leaves.points, [-np.inf, -np.inf, 0.0])
    return Model((Part("Leaves", replace(leaves, points=points), "leaves", "crown", True),))
