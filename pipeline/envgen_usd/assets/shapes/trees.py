"""Trees: trunk, branches, and cards with twigs of leaves."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.design import Model, Part
from envgen_usd.assets.mesh import Mesh, merge, normalised, welded
from envgen_usd.assets.shapes.solids import tube
from envgen_usd.models.arrays import FloatArray


@dataclass(frozen=True)
class Crown:
    """The form of a broad-leaved tree; lengths in metres.

    Attributes:
        height: Of the whole tree.
        width: Diameter of the crown.
        bottom: Where the crown begins.
        widest: Height of the crown's widest place.
        top: Exponent of the outline above the widest place: small is full, large is pointed.
        clusters: Tufts of leaves.
    """

    height: float
    width: float
    bottom: float
    widest: float
    top: float
    clusters: int

    def radius(self, z: FloatArray) -> FloatArray:
        """Radius of the crown at a height."""
        above = np.clip((z - self.widest) / (self.height - self.widest), 0.0, 1.0)
        below = np.clip((self.widest - z) / (self.widest - self.bottom), 0.0, 1.0)
        upper: FloatArray = np.sqrt(np.maximum(1 - above**self.top, 0.0))
        lower: FloatArray = np.sqrt(np.maximum(1 - below**2.4, 0.0))
        radius: FloatArray = np.minimum(upper, lower) * (self.width / 2)
        return radius


CROWNS = {
    "round": Crown(10.0, 6.4, 2.3, 5.6, 2.0, 96),
    "tall": Crown(10.0, 5.0, 1.9, 4.6, 1.5, 92),
    "wide": Crown(10.0, 7.2, 3.0, 6.4, 2.3, 104),
}


def broadleaf(crown: Crown, rng: np.random.Generator) -> Model:
    """A broad-leaved tree that stands on the origin."""
    tufts = _tufts(crown, rng)
    wood = _wood(crown, tufts, rng)
    leaves = _leaf_cards(crown, tufts, rng)
    parts = (
        Part("Wood", wood, "bark", "trunk"),
        Part("Leaves", leaves, "leaves", "crown", double_sided=True),
    )
    return Model(parts, _measured(wood, leaves))


def _measured(*meshes: Mesh) -> tuple[float, float, float]:
    """Mean width, twice, and height above the ground of a tree as it was made."""
    points = np.concatenate([mesh.points for mesh in meshes])
    width = round(float(np.ptp(points[:, :2], axis=0).mean()), 3)
    return width, width, round(float(points[:, 2].max()), 3)


def _tufts(crown: Crown, rng: np.random.Generator) -> FloatArray:
    """Centres of tufts, N x 3, spread over the outer part of the crown (golden angle)."""
    count = crown.clusters
    share = (np.arange(count) + 0.5) / count
    low, high = crown.bottom + 0.35, crown.height - 0.55
    z = low + (high - low) * share + rng.normal(0, 0.15, count)
    bearing = np.arange(count) * 2.399963 + rng.normal(0, 0.25, count)
    inward = np.where(np.arange(count) % 4 == 0, 0.42, rng.uniform(0.72, 0.95, count))
    radius = np.maximum(crown.radius(z) - 0.55, 0.05) * inward
    lumps = 1 + 0.10 * np.sin(3 * bearing + 1.1 * z) + 0.07 * np.sin(2 * bearing - 1.7 * z)
    reach = radius * lumps
    return np.stack([np.cos(bearing) * reach, np.sin(bearing) * reach, z], axis=1)


def _wood(crown: Crown, tufts: FloatArray, rng: np.random.Generator) -> Mesh:
    """Trunk, limbs that reach into the crown, and a branch from a limb to each tuft."""
    z = np.linspace(0.0, crown.height * 0.80, 8)
    sway = np.c_[np.cumsum(rng.normal(0, 0.05, (8, 2)), axis=0) * (z / z[-1])[:, None], z]
    sway[0, :2] = 0.0
    girth = 0.19 * (1 - z / z[-1]) ** 0.8 + 0.025
    girth[0] *= 1.45
    pieces = [tube(sway, girth, 8, caps=False)]
    limbs = _limbs(crown, sway, rng)
    pieces += [tube(limb, np.linspace(0.085, 0.03, len(limb)), 5, caps=False) for limb in limbs]
    joints = np.concatenate([limb[2:] for limb in limbs] + [sway[4:]])
    for tuft in tufts:
        path = _branch(joints, tuft, rng)
        pieces.append(tube(path, np.array([0.030, 0.018, 0.006]), 3, caps=False))
    return merge(pieces)


def _limbs(crown: Crown, trunk: FloatArray, rng: np.random.Generator) -> list[FloatArray]:
    """Main branches, each 6 x 3: out of the trunk, then bending upwards."""
    count = 9
    limbs = []
    for index, share in enumerate(np.linspace(0.0, 1.0, count)):
        foot_z = crown.bottom * 0.85 + share * (crown.height * 0.66 - crown.bottom * 0.85)
        foot = np.array([np.interp(foot_z, trunk[:, 2], trunk[:, axis]) for axis in range(3)])
        bearing = index * 2.399963 + rng.normal(0, 0.2)
        end_z = min(foot_z + rng.uniform(1.3, 2.2), crown.height - 0.9)
        reach = 0.72 * float(crown.radius(np.array([end_z]))[0])
        t = np.linspace(0.0, 1.0, 6)
        out = reach * t**0.85
        limb = (
            foot + np.c_[np.cos(bearing) * out, np.sin(bearing) * out, (end_z - foot_z) * t**1.25]
        )
        limb[1:] += rng.normal(0, 0.05, (5, 3))
        limbs.append(limb)
    return limbs


def _branch(joints: FloatArray, tip: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A bent line, 3 x 3, from the joint that lies nearest (and not above) to a tip."""
    distance = np.linalg.norm(joints - tip, axis=1) + 2.0 * np.maximum(joints[:, 2] - tip[2], 0.0)
    foot = joints[int(np.argmin(distance))]
    middle = (foot + tip) / 2 + rng.normal(0, 0.08, 3) + [0.0, 0.0, 0.06]
    return np.stack([foot, middle, tip])


def _leaf_cards(crown: Crown, tufts: FloatArray, rng: np.random.Generator) -> Mesh:
    """Square cards around each tuft; lit as if the crown were one soft body."""
    each = 9
    count = len(tufts) * each
    offset = normalised(rng.normal(size=(count, 3))) * rng.uniform(0.1, 1.0, (count, 1)) ** 0.5
    centre = np.repeat(tufts, each, axis=0) + offset * np.array([0.62, 0.62, 0.48])
    middle = np.array([0.0, 0.0, crown.bottom + 0.35 * (crown.height - crown.bottom)])
    outward = normalised(centre - middle + np.array([0.0, 0.0, 0.3]))
    soft = normalised(outward + 0.55 * offset)
    facing = normalised(soft + rng.normal(0, 0.55, (count, 3)))
    facing *= np.where((facing * soft).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    side = normalised(np.cross(facing, rng.normal(size=(count, 3))))
    half = rng.uniform(0.36, 0.56, (count, 1))
    return _cards(centre, side * half, np.cross(facing, side) * half, soft)


def _cards(centre: FloatArray, side: FloatArray, up: FloatArray, normal: FloatArray) -> Mesh:
    """Quads, each with the whole texture: centre and half edges, N x 3."""
    corners = np.stack(
        [centre - side - up, centre + side - up, centre + side + up, centre - side + up], axis=1
    )
    count = len(centre)
    bend = normalised(corners - centre[:, None]) * 0.35
    normals = normalised(normal[:, None] + bend)
    uv = np.tile([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], (count, 1))
    points = corners.reshape(-1, 3)
    return Mesh(points, np.full(count, 4), np.arange(4 * count), normals.reshape(-1, 3), uv)


@dataclass(frozen=True)
class Cone:
    """The form of a conifer; lengths in metres.

    Attributes:
        height: Of the whole tree.
        width: Diameter at the lowest branches.
        bottom: Height of the lowest branches.
        fullness: Exponent of the outline: 1 is a cone, less is rounder.
        droop: By how much of its length a branch hangs down.
    """

    height: float
    width: float
    bottom: float
    fullness: float
    droop: float


CONES = {
    "round": Cone(10.0, 5.0, 1.5, 0.72, 0.16),
    "tall": Cone(10.0, 4.0, 1.3, 0.90, 0.20),
    "wide": Cone(10.0, 6.0, 1.9, 0.85, 0.18),
}


def conifer(cone: Cone, rng: np.random.Generator) -> Model:
    """A conifer that stands on the origin."""
    z = np.array([0.0, 0.4, cone.height * 0.5, cone.height * 0.97])
    trunk = tube(np.c_[np.zeros((4, 2)), z], np.array([0.20, 0.15, 0.09, 0.012]), 7, caps=False)
    needles = _whorls(cone, rng)
    parts = (
        Part("Wood", trunk, "bark", "trunk"),
        Part("Leaves", needles, "needles", "crown", double_sided=True),
    )
    return Model(parts, _measured(trunk, needles))


def _whorls(cone: Cone, rng: np.random.Generator) -> Mesh:
    """Branches in rings up the trunk: each a folded strip with a branch's texture."""
    share = np.repeat(np.linspace(0.0, 0.985, 34), 8)
    count = len(share)
    share = np.maximum(share + rng.uniform(-0.014, 0.014, count), 0.0005 * rng.random(count))
    bearing = np.repeat(rng.uniform(0, 6.28, 34), 8) + rng.normal(0, 0.12, count)
    bearing += np.arange(count) * (2 * np.pi / 8)
    length = cone.width / 2 * (1 - share) ** cone.fullness * rng.uniform(0.80, 1.04, count) + 0.12
    foot = np.c_[np.zeros((count, 2)), cone.bottom + share * (cone.height - cone.bottom - 0.25)]
    rise = np.where(share > 0.75, 0.9 * (share - 0.75) / 0.25, 0.0) - cone.droop * (1 - share)
    strips = [_branch_strip(foot, bearing, length, rise, side) for side in (-1.0, 1.0)]
    return welded(merge(strips))


def _branch_strip(
    foot: FloatArray, bearing: FloatArray, length: FloatArray, rise: FloatArray, side: float
) -> Mesh:
    """One half of each branch: two quads from the stem downwards to one side."""
    along = np.array([0.0, 0.55, 1.0])
    out = np.stack([np.cos(bearing), np.sin(bearing), np.zeros_like(bearing)], axis=1)
    across = np.stack([-np.sin(bearing), np.cos(bearing), np.zeros_like(bearing)], axis=1) * side
    height = (rise * length)[:, None] * along + (0.10 * length)[:, None] * np.sin(np.pi * along)
    stem = foot[:, None] + out[:, None] * (length[:, None] * along)[..., None]
    stem = stem + height[..., None] * np.array([0.0, 0.0, 1.0])
    reach = (0.34 * length + 0.10)[:, None, None]
    fringe = stem + reach * (0.80 * across[:, None] - np.array([0.0, 0.0, 0.60]))
    count = len(foot)
    points = np.stack([stem, fringe], axis=2).reshape(-1, 3)
    start = 6 * np.arange(count)[:, None, None] + np.array([0, 2])[None, :, None]
    order = [0, 2, 3, 1] if side > 0 else [0, 1, 3, 2]
    corners = (start + np.array(order)).reshape(-1)
    v = np.array([0.5, 0.5 + 0.5 * side])
    uv = np.stack(np.meshgrid(along, v, indexing="ij"), axis=-1).reshape(-1, 2)
    outward = normalised(out[:, None, None] * 0.8 + across[:, None, None] * 0.35 + [0.0, 0.0, 0.55])
    normals = np.broadcast_to(outward, (count, 3, 2, 3)).reshape(-1, 3)[corners]
    return Mesh(points, np.full(2 * count, 4), corners, normals, uv[corners % 6])
