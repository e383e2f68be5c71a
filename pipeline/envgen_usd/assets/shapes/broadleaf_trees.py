"""Broad-leaved trees."""

from collections.abc import Mapping

from envgen_usd.assets.shapes.crowned_trees import Species
from envgen_usd.assets.shapes.foliage_cards import Tiles
from envgen_usd.assets.shapes.tree_skeletons import Growth
from envgen_usd.assets.textures.foliage_textures import BROADLEAVES

_TILES = {habit: Tiles(row, len(BROADLEAVES)) for row, habit in enumerate(BROADLEAVES)}

BROADLEAF_SPECIES: Mapping[str, Species] = {
    "lime": Species((0.9, 2.4, 3.0, 2.9, 2.4, 1.5, 0.3), 2.0, 0.75, _TILES["spreading"]),
    "plane": Species(
        (1.2, 2.9, 3.5, 3.6, 3.1, 2.1, 0.5), 2.6, 0.42, _TILES["spreading"], "bark_pale",
        Growth(step=0.40, kill=0.55, rise=0.10), space=560, twig=1.25,
    ),
    "maple": Species(
        (1.3, 2.8, 3.3, 3.1, 2.5, 1.4, 0.2), 1.9, 0.5, _TILES["spreading"], "bark_dark",
    ),
    "oak": Species(
        (1.4, 3.2, 3.8, 3.8, 3.3, 2.3, 0.7), 2.3, 0.4, _TILES["gnarled"], "bark_dark",
        Growth(step=0.40, kill=0.56, rise=-0.02), space=560, twig=1.2,
    ),
    "birch": Species(
        (1.0, 2.1, 2.4, 2.1, 1.6, 1.0, 0.3), 1.6, 0.92, _TILES["hanging"], "bark_birch",
        Growth(step=0.32, kill=0.42, rise=0.45), twig=1.35, breadth=0.7, hang=0.65, tufts=3,
    ),
    "poplar": Species(
        (0.8, 1.5, 1.9, 2.0, 1.8, 1.3, 0.3), 0.9, 0.92, _TILES["upright"], "bark",
        Growth(step=0.34, kill=0.44, rise=0.75), twig=1.25, breadth=0.75, hang=-0.9, tufts=3,
    ),
    "cherry": Species(
        (1.8, 3.2, 3.6, 3.4, 2.7, 1.6, 0.4), 2.4, 0.28, _TILES["upright"], "bark_dark",
        Growth(rise=0.22), twig=1.1, hang=-0.3,
    ),
    "willow": Species(
        (2.6, 3.4, 3.7, 3.7, 3.3, 2.4, 0.9), 2.2, 0.45, _TILES["hanging"], "bark",
        Growth(step=0.40, kill=0.58), twig=2.1, breadth=0.5, hang=2.6,
    ),
    "rowan": Species(
        (0.7, 1.9, 2.5, 2.6, 2.2, 1.3, 0.2), 1.6, 0.5, _TILES["gnarled"], "bark",
        Growth(step=0.34, kill=0.46, rise=0.3), twig=0.95, hang=-0.2, tufts=3,
    ),
}  # fmt: skip
"""Broad-leaved trees by name."""
