"""Trees whose branches grow into a crown, with cards that show their twigs."""

from dataclasses import dataclass, field

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, normalised
from envgen_usd.assets.shapes.foliage_cards import Shoots, Tiles, cards, distant_cards
from envgen_usd.assets.shapes.simple_solids import tube, upright_size
from envgen_usd.assets.shapes.tree_skeletons import Growth, Skeleton, grown, wood
from envgen_usd.models.array_types import FloatArray

FAR_CARDS = 27
"""Cards of a distant crown; with a stem of three sides they make 60 triangles."""
_HEIGHT = 10.0


@dataclass(frozen=True)
class Species:
    """A tree of 10 m whose branches fill a crown; lengths in metres.

    Attributes:
        outline: Radii of the crown at equal steps from its lower edge to its top.
        bottom: Height of the crown's lower edge.
        stem: Height that the stem reaches as one, as a share of the tree's.
        tiles: Row of the atlas with its twigs.
        bark: Material of the wood.
        growth: How the branches grow.
        space: Points of free space; more make more branches.
        twig: Length of a twig's card.
        breadth: Its width as a share of its length.
        hang: Pull downwards on the twigs, against their direction, 1.
        tufts: Twigs at each tip.
    """

    outline: tuple[float, ...]
    bottom: float
    stem: float
    tiles: Tiles
    bark: str = "bark"
    growth: Growth = field(default_factory=Growth)
    space: int = 480
    twig: float = 1.15
    breadth: float = 0.85
    hang: float = -0.1
    tufts: int = 2

    def radius(self, z: FloatArray) -> FloatArray:
        """Radius of the crown at heights."""
        steps = np.linspace(self.bottom, _HEIGHT, len(self.outline))
        return np.interp(z, steps, self.outline, left=0.0, right=0.0)


def crowned_tree(species: Species, foliage: str, rng: np.random.Generator) -> Model:
    """A tree with its base at the origin, and a simpler one for the distance.

    Args:
        species: Its form.
        foliage: Material of its twigs.
        rng: Random generator.
    """
    skeleton = grown(_stems(species, rng), _space(species, rng), species.growth, rng)
    shoots = _shoots(species, skeleton, rng)
    middle = np.array([0.0, 0.0, 0.65 * species.bottom + 0.35 * _HEIGHT])
    bark, leaves = wood(skeleton, 7), cards(shoots, species.tiles, species.breadth, middle, rng)
    far = distant_cards(shoots, species.tiles, FAR_CARDS, middle, rng)
    parts = (
        Part("Wood", bark, species.bark, "trunk"),
        Part("Leaves", leaves, foliage, "crown", double_sided=True),
        Part("WoodProxy", _far_stem(skeleton), species.bark, "trunk", proxy_of="Wood"),
        Part("LeavesProxy", far, foliage, "crown", double_sided=True, proxy_of="Leaves"),
    )
    return Model(parts, upright_size(bark, leaves))


def _stems(species: Species, rng: np.random.Generator) -> FloatArray:
    """Nodes of the stem from the foot up, slightly bent."""
    top = species.stem * _HEIGHT
    z = np.linspace(0.0, top, max(round(top / species.growth.step), 3))
    sway = np.cumsum(rng.normal(0, 0.03, (len(z), 2)), axis=0) * np.minimum(z / top, 1.0)[:, None]
    return np.concatenate([sway, z[:, None]], axis=1)


def _space(species: Species, rng: np.random.Generator) -> FloatArray:
    """Points in the crown, denser towards its surface; lobes and dents break its outline."""
    reach = species.twig * 0.75
    count = 6 * species.space
    z = rng.uniform(species.bottom, _HEIGHT - 0.6 * reach, count)
    bearing = rng.uniform(0, 2 * np.pi, count)
    phase = rng.uniform(0, 2 * np.pi, 4)
    lumps = 1.0 + 0.13 * np.sin(2 * bearing + 0.9 * z + phase[0])
    lumps += 0.10 * np.sin(3 * bearing - 1.4 * z + phase[1])
    lumps += 0.08 * np.sin(5 * bearing + 2.1 * z + phase[2])
    radius = species.radius(z)
    largest = max(species.outline)
    kept = rng.random(count) < (radius / largest) ** 2 + 0.08
    share = rng.uniform(0.03, 1.0, count) ** 0.45
    away = np.maximum(radius * lumps - 0.7 * reach, 0.12) * share
    points = np.stack([np.cos(bearing) * away, np.sin(bearing) * away, z], axis=1)
    return points[kept][: species.space]


def _shoots(species: Species, skeleton: Skeleton, rng: np.random.Generator) -> Shoots:
    """Twigs at all tips, and along the thin branches."""
    tips = skeleton.tips()
    thin = (skeleton.radii < 0.028) & (skeleton.points[:, 2] > 0.8 * species.bottom)
    chosen = np.concatenate(
        [np.flatnonzero(tips & thin).repeat(species.tufts), np.flatnonzero(thin & ~tips)]
    )
    feet, along = skeleton.points[chosen], skeleton.directions()[chosen]
    outward = normalised(feet * np.array([1.0, 1.0, 0.0]))
    headings = along + 0.35 * outward + rng.normal(0, 0.42, along.shape)
    headings[:, 2] -= species.hang
    lengths = species.twig * rng.uniform(0.75, 1.15, len(chosen))
    headings = normalised(headings)
    # Hanging twigs end above the ground.
    room = np.where(headings[:, 2] < 0, (feet[:, 2] - 0.9) / np.maximum(-headings[:, 2], 1e-6), 9.0)
    return Shoots(feet, headings, np.maximum(np.minimum(lengths, room), 0.4 * species.twig))


def _far_stem(skeleton: Skeleton) -> Mesh:
    """The stem as a single bar with three sides."""
    top = np.array([0.0, 0.0, 0.55 * _HEIGHT])
    path = np.stack([skeleton.points[0], top])
    return tube(path, skeleton.radii[0] * np.array([1.0, 0.5]), 3, caps=False)
