"""Shrubs: cards with twigs on all sides, down to the ground."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, normalised
from envgen_usd.assets.shapes.foliage_cards import Shoots, Tiles, cards, distant_cards
from envgen_usd.assets.shapes.simple_solids import upright_size


@dataclass(frozen=True)
class Shrub:
    """A shrub; lengths in metres.

    Attributes:
        height: Its height.
        width: Its width.
        row: Row of the atlas.
        across: Tiles along each side of the atlas.
        twigs: Number of cards.
        twig: Length of a card.
        rise: Pull upwards on its twigs, against that away from its middle, 1.
    """

    height: float
    width: float
    row: int
    across: int
    twigs: int
    twig: float
    rise: float


DECIDUOUS_SHRUBS: Mapping[str, Shrub] = {
    "round": Shrub(1.5, 1.7, 1, 4, 190, 0.50, 0.5),
    "upright": Shrub(1.7, 1.5, 3, 4, 180, 0.62, 1.8),
}
EVERGREEN_SHRUBS: Mapping[str, Shrub] = {
    "laurel": Shrub(1.5, 1.8, 0, 2, 170, 0.50, 0.5),
    "low": Shrub(0.8, 1.6, 1, 2, 150, 0.36, 0.4),
}


def shrub(form: Shrub, foliage: str, rng: np.random.Generator) -> Model:
    """A shrub with twigs down to the ground, and a simpler one for the distance.

    Args:
        form: Its form.
        foliage: Material of its twigs.
        rng: Random generator.
    """
    height = (form.height - 0.75 * form.twig) * rng.uniform(0.0, 1.0, form.twigs)
    bearing = np.arange(form.twigs) * 2.399963
    bulge = np.sqrt(np.maximum(1.0 - (height / (1.05 * form.height)) ** 2, 0.0))
    reach = (0.5 * form.width - 0.6 * form.twig) * bulge * rng.uniform(0.25, 1.0, form.twigs) ** 0.5
    reach *= 1.0 + 0.14 * np.sin(3 * bearing + 4 * height)
    feet = np.stack([np.cos(bearing) * reach, np.sin(bearing) * reach, height], axis=1)
    away = normalised(feet * np.array([1.0, 1.0, 0.35]) + 1e-3) + rng.normal(0, 0.35, feet.shape)
    headings = normalised(away + np.array([0.0, 0.0, form.rise]))
    shoots = Shoots(feet, headings, form.twig * rng.uniform(0.8, 1.2, form.twigs))
    middle, tiles = np.array([0.0, 0.0, 0.2 * form.height]), Tiles(form.row, form.across)
    near = _grounded(cards(shoots, tiles, 0.9, middle, rng))
    far = _grounded(distant_cards(shoots, tiles, 12, middle, rng))
    parts = (
        Part("Leaves", near, foliage, "crown", double_sided=True),
        Part("LeavesProxy", far, foliage, "crown", double_sided=True, proxy_of="Leaves"),
    )
    return Model(parts, upright_size(near))


def _grounded(mesh: Mesh) -> Mesh:
    """The mesh, lowered until it touches the ground."""
    return replace(mesh, points=mesh.points - [0.0, 0.0, mesh.points[:, 2].min()])
