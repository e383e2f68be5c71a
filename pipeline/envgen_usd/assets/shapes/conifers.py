"""Conifers: whorls of branches around a stem, or branches that fill a crown."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, normalised
from envgen_usd.assets.shapes.crowned_trees import FAR_CARDS, Species
from envgen_usd.assets.shapes.foliage_cards import Shoots, Tiles, cards, distant_cards
from envgen_usd.assets.shapes.simple_solids import tube, upright_size
from envgen_usd.assets.shapes.tree_skeletons import Growth

_SPRUCE, _PINE = Tiles(0, 2), Tiles(1, 2)
_HEIGHT = 10.0


@dataclass(frozen=True)
class Cone:
    """A conifer of 10 m with whorls; lengths in metres.

    Attributes:
        width: Diameter at the lowest branches.
        bottom: Height of the lowest branches.
        fullness: Exponent of the outline: 1 is a cone, a smaller value is rounder.
        droop: Drop of the branch tips as a share of the branch length.
        whorls: Number of rings of branches.
    """

    width: float
    bottom: float
    fullness: float
    droop: float
    whorls: int


CONES: Mapping[str, Cone] = {
    "spruce": Cone(4.6, 0.8, 0.85, 0.28, 24),
    "fir": Cone(5.4, 1.4, 0.75, 0.08, 20),
}
"""Conifers with whorls by name."""

CONIFER_SPECIES: Mapping[str, Species] = {
    "pine": Species(
        (0.7, 2.2, 2.7, 2.6, 2.0, 0.8), 4.3, 0.85, _PINE, "bark_dark",
        Growth(step=0.40, kill=0.62, rise=0.15), space=300, twig=1.0, breadth=0.95, hang=-0.3,
        tufts=3,
    ),
    "yew": Species(
        (2.0, 2.7, 2.9, 2.7, 2.2, 1.5, 0.3), 0.5, 0.6, _SPRUCE, "bark_dark",
        Growth(step=0.36, kill=0.48, rise=0.2), space=620, twig=1.15, breadth=0.9, hang=0.1,
        tufts=4,
    ),
    "cypress": Species(
        (1.2, 1.7, 1.8, 1.6, 1.2, 0.3), 0.2, 0.95, _SPRUCE, "bark",
        Growth(step=0.33, kill=0.42, rise=0.6), space=520, twig=1.1, breadth=0.9, hang=-0.8,
        tufts=4,
    ),
}  # fmt: skip
"""Conifers whose branches fill a crown by name."""


def whorled_tree(cone: Cone, foliage: str, rng: np.random.Generator) -> Model:
    """A conifer with its base at the origin, and a simpler one for the distance.

    Args:
        cone: Its form.
        foliage: Material of its branches.
        rng: Random generator.
    """
    shoots = _branches(cone, rng)
    middle = np.array([0.0, 0.0, 0.3 * _HEIGHT])
    wood, needles = _stem(7), cards(shoots, _SPRUCE, 0.62, middle, rng)
    far = distant_cards(shoots, _SPRUCE, FAR_CARDS, middle, rng)
    parts = (
        Part("Wood", wood, "bark_dark", "trunk"),
        Part("Leaves", needles, foliage, "crown", double_sided=True),
        Part("WoodProxy", _stem(3, joints=2), "bark_dark", "trunk", proxy_of="Wood"),
        Part("LeavesProxy", far, foliage, "crown", double_sided=True, proxy_of="Leaves"),
    )
    return Model(parts, upright_size(wood, needles))


def _stem(sides: int, joints: int = 4) -> Mesh:
    z = np.linspace(0.0, 0.96 * _HEIGHT, joints)
    axis = np.concatenate([np.zeros((joints, 2)), z[:, None]], axis=1)
    return tube(axis, np.linspace(0.17, 0.012, joints), sides, caps=False)


def _branches(cone: Cone, rng: np.random.Generator) -> Shoots:
    """Branches in rings up the stem; lower ones are longer and hang, and fork near their tips."""
    each = 8
    count = cone.whorls * each
    share = np.repeat(np.linspace(0.0, 0.97, cone.whorls), each)
    share = np.clip(share + rng.uniform(-0.4, 0.4, count) / cone.whorls, 0.0, 0.98)
    bearing = np.arange(count) * (2 * np.pi / each) + np.repeat(
        rng.uniform(0, 6.28, cone.whorls), each
    )
    bearing += rng.normal(0, 0.2, count)
    span = cone.width / 2 * (1 - share) ** cone.fullness * rng.uniform(0.75, 1.08, count) + 0.18
    rise = np.where(share > 0.7, 1.1 * (share - 0.7) / 0.3, 0.0) - cone.droop * (1 - share)
    z = cone.bottom + share * (_HEIGHT - cone.bottom - 0.3)
    feet = np.concatenate([np.zeros((count, 2)), z[:, None]], axis=1)
    out = np.stack([np.cos(bearing), np.sin(bearing), rise + rng.normal(0, 0.08, count)], axis=1)
    out = normalised(out)
    forks = np.repeat(np.flatnonzero(span > 0.7), 2)
    turned = out[forks] + rng.normal(0, 0.45, (len(forks), 3))
    middle = feet[forks] + 0.45 * span[forks, None] * out[forks]
    return Shoots(
        np.concatenate([feet, middle]),
        np.concatenate([out, normalised(turned)]),
        np.concatenate([span, 0.55 * span[forks]]),
    )
