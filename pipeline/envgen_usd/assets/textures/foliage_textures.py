"""Foliage textures with opacity cut-outs: atlases whose tiles are twigs of several habits.

A row of tiles is a habit. Its first tiles are fans of twigs from a foot at the lower edge, in
different shades; the last is a piece of a crown, for trees in the distance. The season changes the
atlas, not the meshes: all seasons have the same twigs.
"""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.twig_drawing import (
    Blade,
    Canvas,
    Habit,
    Twig,
    fan,
    paint_leaves,
    paint_twigs,
)
from envgen_usd.models.array_types import FloatArray

TILE = 256
"""Pixels along each side of a tile."""
_PIECE = 0.36
"""Size of a fan in a piece of a crown, as a share of its size on a tile of its own."""


@dataclass(frozen=True)
class Row:
    """A row of tiles.

    Attributes:
        habit: How its twigs branch.
        blade: Its leaves.
        leaves: Reflectance of leaves on each of its tiles with a single fan.
        wood: Reflectance of its twigs.
        fans: Fans in a piece of a crown.
    """

    habit: Habit
    blade: Blade
    leaves: tuple[Colour, ...]
    wood: Colour
    fans: int = 26


def _greens(*middle: float) -> tuple[Colour, ...]:
    """Three shades of a green: fresh, usual, and dark and blueish."""
    red, green, blue = middle
    return (
        (1.22 * red, 1.16 * green, 0.95 * blue),
        (red, green, blue),
        (0.72 * red, 0.80 * green, 0.95 * blue),
    )


_SPREADING = Habit((-0.42, 0.02, 0.40), 0.80, 14, 0.80, 0.48, 0.15, 0.07, 0.0090)
_GNARLED = Habit((-0.55, -0.10, 0.30, 0.62), 0.72, 12, 0.98, 0.48, -0.10, 0.14, 0.0090)
_HANGING = Habit((-0.16, -0.05, 0.06, 0.17), 0.90, 12, 0.32, 0.50, 0.05, 0.05, 0.0070)
_UPRIGHT = Habit((-0.30, -0.08, 0.10, 0.28), 0.84, 13, 0.55, 0.46, -0.20, 0.06, 0.0085)

BROADLEAVES: Mapping[str, Row] = {
    "spreading": Row(
        _SPREADING, Blade((0.065, 0.105), 0.72, 0, 200), _greens(0.100, 0.142, 0.042),
        (0.140, 0.121, 0.104),
    ),
    "gnarled": Row(
        _GNARLED, Blade((0.065, 0.095), 0.60, 3, 240), _greens(0.084, 0.118, 0.036),
        (0.126, 0.112, 0.098), 22,
    ),
    "hanging": Row(
        _HANGING, Blade((0.050, 0.085), 0.46, 0, 360), _greens(0.118, 0.160, 0.056),
        (0.140, 0.112, 0.095),
    ),
    "upright": Row(
        _UPRIGHT, Blade((0.050, 0.085), 0.60, 0, 280), _greens(0.096, 0.146, 0.046),
        (0.142, 0.122, 0.106),
    ),
}  # fmt: skip
"""Rows of the atlases of broad-leaved trees, from below."""
_NEEDLES: Mapping[str, Row] = {
    "spruce": Row(
        Habit((-0.02,), 0.90, 17, 0.95, 0.42, 0.10, 0.03, 0.0150),
        Blade((0.026, 0.040), 0.17, 0, 1500), ((0.060, 0.088, 0.044),), (0.110, 0.085, 0.065), 34,
    ),
    "pine": Row(
        Habit((-0.40, 0.03, 0.42), 0.66, 6, 0.70, 0.46, 0.0, 0.10, 0.0160),
        Blade((0.060, 0.095), 0.075, 0, 1100), ((0.080, 0.104, 0.058),), (0.140, 0.095, 0.065), 22,
    ),
}  # fmt: skip
"""Rows of the atlas of conifers."""
_EVERGREENS: Mapping[str, Row] = {
    "laurel": Row(
        _UPRIGHT, Blade((0.090, 0.140), 0.44, 0, 380), ((0.082, 0.112, 0.042),),
        (0.130, 0.105, 0.080),
    ),
    "privet": Row(
        _SPREADING, Blade((0.045, 0.065), 0.55, 0, 1100), ((0.096, 0.118, 0.052),),
        (0.130, 0.105, 0.080),
    ),
}  # fmt: skip
"""Rows of the atlas of evergreen shrubs."""
_AUTUMN: Mapping[str, tuple[Colour, ...]] = {
    "spreading": ((0.42, 0.26, 0.035), (0.30, 0.13, 0.030), (0.24, 0.17, 0.040)),
    "gnarled": ((0.26, 0.13, 0.035), (0.20, 0.10, 0.035), (0.19, 0.14, 0.040)),
    "hanging": ((0.42, 0.30, 0.050), (0.36, 0.24, 0.040), (0.27, 0.22, 0.055)),
    "upright": ((0.36, 0.10, 0.030), (0.40, 0.22, 0.035), (0.22, 0.16, 0.040)),
}
"""Reflectance of leaves in autumn."""
_SHADED, _SHADED_NEEDLES = 0.88, 0.80
"""Light of a piece of a crown, of what single leaves reflect: its leaves shade each other, which
the few cards of a distant tree do not."""
_DRY = 0.7
"""Share of the leaves that are left in autumn."""


def _tile(row: Row, colour: Colour, *, leaves: float, whole: bool, seed: int) -> FloatArray:
    """A tile, TILE x TILE x 4: reflectance and opacity.

    Args:
        row: Look of its twigs.
        colour: Reflectance of its leaves.
        leaves: Share of the leaves; 0 for bare twigs.
        whole: True for a piece of a crown.
        seed: Twigs of equal seeds are equal, with and without leaves.
    """
    bare, groups, drawn_so_far = _bare_tile(row.habit, row.fans, whole=whole, seed=seed)
    canvas = bare.copy()
    if leaves:
        rng = copy.deepcopy(drawn_so_far)
        count = round(leaves * row.blade.count * (0.30 if whole else 1.0))
        blade = Blade(row.blade.length, row.blade.breadth, row.blade.lobes, count)
        for twigs in groups:
            paint_leaves(canvas, twigs, blade, 0.62 if whole else 1.0, rng)
    shade, leaf, opacity = canvas.layers()
    tint = leaf[..., None] * np.array(colour) + (1.0 - leaf[..., None]) * np.array(row.wood)
    mean = np.array(colour if leaves else row.wood)
    drawn = opacity[..., None] > 0
    return np.concatenate([np.where(drawn, shade[..., None] * tint, mean), opacity[..., None]], 2)


@cache
def _bare_tile(
    habit: Habit, fans: int, *, whole: bool, seed: int
) -> tuple[Canvas, list[list[Twig]], np.random.Generator]:
    """The twigs of a tile, which all seasons share: drawn, as lines, and the generator after them.

    The caller changes none of them.
    """
    rng, canvas = np.random.default_rng(seed), Canvas(TILE)
    groups = _piece(habit, fans, rng) if whole else [fan(habit, np.array([0.5, 0.015]), 0.0, rng)]
    for twigs in groups:
        paint_twigs(canvas, twigs, rng)
    return canvas, groups, rng


def _piece(habit: Habit, fans: int, rng: np.random.Generator) -> list[list[Twig]]:
    """Small fans that fill a ragged disc, mostly turned outwards and upwards."""
    groups = []
    for number in range(fans):
        bearing = 2.399963 * number
        away = 0.36 * np.sqrt((number + 0.5) / fans)
        foot = 0.5 + away * np.array([-np.sin(bearing), np.cos(bearing)]) - np.array([0.0, 0.10])
        turn = (bearing + np.pi) % (2 * np.pi) - np.pi
        # Outer fans are short, so that the rim is ragged and inside the tile.
        small = _scaled(habit, _PIECE * (1.15 - 1.6 * away))
        groups.append(fan(small, foot, 0.7 * turn + rng.normal(0, 0.8), rng))
    return groups


def _scaled(habit: Habit, size: float) -> Habit:
    # Twigs that shrank in proportion would be thinner than a pixel.
    width = 0.62 * habit.width
    return Habit(
        habit.stems, size * habit.length, max(habit.sides - 3, 4), habit.angle, habit.reach,
        habit.droop, habit.wander, width,
    )  # fmt: skip


def _atlas(
    rows: Sequence[Row],
    colours: Sequence[tuple[Colour, ...]],
    *,
    leaves: float,
    seed: int,
    shaded: float = _SHADED,
) -> Texture:
    """A square of tiles: a line of tiles for each row, the last of which is a piece of a crown."""
    lines = []
    for number, (row, shades) in enumerate(zip(rows, colours, strict=True)):
        mean = shaded * np.mean(shades, axis=0)
        tiles = [
            _tile(row, shade, leaves=leaves, whole=False, seed=seed + 10 * number + column)
            for column, shade in enumerate(shades)
        ]
        piece = _tile(row, mean, leaves=leaves, whole=True, seed=seed + 10 * number + 9)
        lines.append(np.concatenate([*tiles, piece], axis=1))
    pixels = np.concatenate(lines, axis=0)
    return Texture(1.0, pixels[..., :3], opacity=pixels[..., 3])


def leaves(_rng: np.random.Generator) -> Texture:
    """Broad leaves in summer."""
    rows = tuple(BROADLEAVES.values())
    return _atlas(rows, [row.leaves for row in rows], leaves=1.0, seed=100)


def leaves_autumn(_rng: np.random.Generator) -> Texture:
    """Broad leaves in autumn."""
    return _atlas(tuple(BROADLEAVES.values()), list(_AUTUMN.values()), leaves=_DRY, seed=100)


def twigs(_rng: np.random.Generator) -> Texture:
    """Bare twigs in winter."""
    rows = tuple(BROADLEAVES.values())
    return _atlas(rows, [row.leaves for row in rows], leaves=0.0, seed=100)


def needles(_rng: np.random.Generator) -> Texture:
    """Sprays of spruce, and tufts of pine."""
    rows = tuple(_NEEDLES.values())
    return _atlas(rows, [row.leaves for row in rows], leaves=1.0, seed=300, shaded=_SHADED_NEEDLES)


def leaves_evergreen(_rng: np.random.Generator) -> Texture:
    """Large and small leaves that stay in winter."""
    rows = tuple(_EVERGREENS.values())
    return _atlas(rows, [row.leaves for row in rows], leaves=1.0, seed=400)
