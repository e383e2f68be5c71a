"""Conifers: a trunk and whorls of branches, each a strip folded along its stem."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge, normalised, welded
from envgen_usd.assets.shapes.simple_solids import tube, upright_size
from envgen_usd.models.array_types import FloatArray


@dataclass(frozen=True)
class Cone:
    """The shape of a conifer; lengths in metres.

    Attributes:
        height: Height of the tree.
        width: Diameter at the lowest branches.
        bottom: Height of the lowest branches.
        fullness: Exponent of the outline: 1 is a cone, a smaller value is rounder.
        droop: Drop of the branch tips as a share of the branch length.
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


@dataclass(frozen=True)
class _Branches:
    """N branches; lengths in metres, angles in radians.

    Attributes:
        foot: N x 3, attachment points on the trunk.
        bearing: N.
        length: N.
        rise: N, height of the tip above the foot as a share of the length.
        fold: N, downward slope of both halves from the stem, metres per metre.
    """

    foot: FloatArray
    bearing: FloatArray
    length: FloatArray
    rise: FloatArray
    fold: FloatArray


def conifer(cone: Cone, rng: np.random.Generator) -> Model:
    """A conifer with its base at the origin, and a simpler proxy."""
    near = _branches(cone, 26, 8, rng)
    far = _branches(cone, 9, 6, rng)
    wood = _trunk(cone, 7)
    needles = _strips(near, np.array([0.0, 0.55, 1.0]), 0.36)
    parts = (
        Part("Wood", wood, "bark", "trunk"),
        Part("Leaves", needles, "needles", "crown", double_sided=True),
        Part("WoodProxy", _trunk(cone, 4), "bark", "trunk", proxy_of="Wood"),
        Part(
            "LeavesProxy",
            _strips(far, np.array([0.0, 1.0]), 0.52),
            "needles",
            "crown",
            double_sided=True,
            proxy_of="Leaves",
        ),
    )
    return Model(parts, upright_size(wood, needles))


def _trunk(cone: Cone, sides: int) -> Mesh:
    z = np.array([0.0, 0.4, cone.height * 0.5, cone.height * 0.97])
    axis = np.concatenate([np.zeros((4, 2)), z[:, None]], axis=1)
    return tube(axis, np.array([0.20, 0.15, 0.09, 0.012]), sides, caps=False)


def _branches(cone: Cone, whorls: int, each: int, rng: np.random.Generator) -> _Branches:
    """Branches in rings up the trunk; lower branches are longer and hang lower."""
    count = whorls * each
    apart = 0.985 / whorls
    share = np.repeat(np.linspace(0.0, 0.985, whorls), each)
    share = share + rng.uniform(-0.45, 0.45, count) * apart
    share = np.maximum(share, 0.0005 * rng.random(count))
    bearing = np.repeat(rng.uniform(0, 6.28, whorls), each) + rng.normal(0, 0.16, count)
    bearing += np.arange(count) * (2 * np.pi / each)
    span = cone.width / 2 * np.maximum(1 - share, 0.0) ** cone.fullness
    z = cone.bottom + share * (cone.height - cone.bottom - 0.25)
    rise = np.where(share > 0.75, 0.9 * (share - 0.75) / 0.25, 0.0) - cone.droop * (1 - share)
    return _Branches(
        np.concatenate([np.zeros((count, 2)), z[:, None]], axis=1),
        bearing,
        span * rng.uniform(0.74, 1.06, count) + 0.12,
        rise + rng.normal(0, 0.05, count),
        rng.uniform(0.45, 0.85, count),
    )


def _strips(branches: _Branches, along: FloatArray, reach: float) -> Mesh:
    """Both halves of all branches, folded down from the stem."""
    return welded(merge([_half(branches, along, reach, side) for side in (-1.0, 1.0)]))


def _half(branches: _Branches, along: FloatArray, reach: float, side: float) -> Mesh:
    """Quads from the stem downwards to one side.

    Args:
        branches: N branches.
        along: K positions along a branch, 0 to 1.
        reach: Width of the half as a share of the branch's length.
        side: -1 or 1.
    """
    bearing, length = branches.bearing, branches.length
    out = np.stack([np.cos(bearing), np.sin(bearing), np.zeros_like(bearing)], axis=1)
    across = np.stack([-np.sin(bearing), np.cos(bearing), np.zeros_like(bearing)], axis=1) * side
    up = np.array([0.0, 0.0, 1.0])
    height = (branches.rise * length)[:, None] * along
    height = height + (0.10 * length)[:, None] * np.sin(np.pi * along)
    stem = branches.foot[:, None] + out[:, None] * (length[:, None] * along)[..., None]
    stem = stem + height[..., None] * up
    width = (reach * length + 0.10)[:, None, None]
    fringe = stem + width * (0.80 * across[:, None] - branches.fold[:, None, None] * up)
    count, steps = len(length), len(along) - 1
    points = np.stack([stem, fringe], axis=2).reshape(-1, 3)
    start = 2 * (steps + 1) * np.arange(count)[:, None, None]
    first = start + 2 * np.arange(steps)[None, :, None]
    order = [0, 2, 3, 1] if side > 0 else [0, 1, 3, 2]
    corners = (first + np.array(order)).reshape(-1)
    v = np.array([0.5, 0.5 + 0.5 * side])
    uv = np.stack(np.meshgrid(along, v, indexing="ij"), axis=-1).reshape(-1, 2)
    outward = normalised(out[:, None, None] * 0.8 + across[:, None, None] * 0.35 + 0.55 * up)
    normals = np.broadcast_to(outward, (count, steps + 1, 2, 3)).reshape(-1, 3)[corners]
    sizes = np.full(steps * count, 4)
    return Mesh(points, sizes, corners, normals, uv[corners % (2 * (steps + 1))])
