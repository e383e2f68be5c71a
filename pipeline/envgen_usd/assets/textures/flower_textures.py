"""Flowering plants with opacity cut-outs: an atlas with the tiles of the broad leaves' atlases.

So a bed in summer becomes a bed in autumn or winter by another material, as trees do.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.foliage_textures import TILE
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

_STEM: Colour = (0.090, 0.110, 0.050)
_CENTRE: Colour = (0.42, 0.27, 0.03)
_LEAST_HEIGHT = 0.3
"""Least height of a blossom, share of the tile; a larger value leaves more leaves bare."""
_CLUMP = ((0.30, 0.05), (0.70, 0.05), (0.5, 0.3), (0.25, 0.42), (0.75, 0.40))
"""Feet of the plants of a clump, which distant beds show."""


@dataclass(frozen=True)
class _Plant:
    """A row of tiles: stems, leaves, their reflectance, and blossoms.

    Attributes:
        habit: How its stems branch.
        blade: Its leaves.
        green: Reflectance of its leaves.
        petals: Reflectance of the petals on each tile with a single plant.
        blossoms: Blossoms of a plant.
        radius: Radius of a blossom, share of the tile.
        count: Petals of a blossom.
    """

    habit: Habit
    blade: Blade
    green: Colour
    petals: tuple[Colour, Colour, Colour]
    blossoms: int
    radius: float
    count: int


_BRUSHY = Habit((-0.35, -0.12, 0.10, 0.34), 0.72, 6, 0.60, 0.36, 0.05, 0.06, 0.012)
_SPIRED = Habit((-0.20, -0.07, 0.06, 0.19), 0.86, 8, 0.35, 0.20, 0.0, 0.04, 0.011)
_ROSE, _PINK, _CREAM = (0.36, 0.02, 0.03), (0.46, 0.13, 0.20), (0.55, 0.48, 0.34)
_VIOLET, _BLUE, _WHITE = (0.17, 0.08, 0.30), (0.10, 0.13, 0.38), (0.62, 0.62, 0.58)
_YELLOW, _ORANGE, _LILAC = (0.58, 0.40, 0.03), (0.52, 0.18, 0.02), (0.34, 0.22, 0.42)
_PLANTS = (
    _Plant(_BRUSHY, Blade((0.08, 0.13), 0.55, 0, 230), (0.104, 0.156, 0.048),
           (_ROSE, _PINK, _CREAM), 14, 0.055, 7),
    _Plant(_SPIRED, Blade((0.09, 0.16), 0.22, 0, 200), (0.122, 0.170, 0.070),
           (_VIOLET, _BLUE, _LILAC), 60, 0.022, 4),
    _Plant(_BRUSHY, Blade((0.09, 0.15), 0.34, 2, 220), (0.124, 0.180, 0.056),
           (_YELLOW, _ORANGE, _WHITE), 18, 0.045, 9),
    _Plant(_BRUSHY, Blade((0.07, 0.11), 0.62, 0, 260), (0.112, 0.166, 0.058),
           (_WHITE, _PINK, _VIOLET), 34, 0.027, 5),
)  # fmt: skip
"""Rows from below: roses, spires, daisies, small blossoms."""


def flowers(_rng: np.random.Generator) -> Texture:
    """Flowering plants: each row has three colours, and a clump for beds in the distance."""
    lines = []
    for number, plant in enumerate(_PLANTS):
        tiles = [_tile(plant, (colour,), 500 + 10 * number + i)
                 for i, colour in enumerate(plant.petals)]  # fmt: skip
        clump = _tile(plant, plant.petals, 509 + 10 * number, feet=_CLUMP, scale=0.5)
        lines.append(np.concatenate([*tiles, clump], axis=1))
    pixels = np.concatenate(lines, axis=0)
    return Texture(1.0, pixels[..., :3], opacity=pixels[..., 3])


def _tile(
    plant: _Plant,
    petals: Sequence[Colour],
    seed: int,
    feet: Sequence[tuple[float, float]] = ((0.5, 0.015),),
    scale: float = 1.0,
) -> FloatArray:
    """A tile, TILE x TILE x 4: reflectance and opacity; each foot has petals of the next colour."""
    rng, green = np.random.default_rng(seed), Canvas(TILE)
    groups = [_scaled_fan(plant.habit, np.array(foot), scale, rng) for foot in feet]
    for twigs in groups:
        paint_twigs(green, twigs, rng)
        count = round(plant.blade.count * (0.5 if scale < 1.0 else 1.0))
        paint_leaves(green, twigs, _with_count(plant.blade, count), scale**0.5, rng)
    layers = [_foliage(green, plant.green)]
    for number, colour in enumerate(petals):
        canvas = Canvas(TILE)
        for twigs in groups[number :: len(petals)]:
            _paint_blossoms(canvas, twigs, plant, scale**0.5, rng)
        layers.append(_blossoms(canvas, colour))
    return _composed(layers, plant.green)


def _with_count(blade: Blade, count: int) -> Blade:
    return Blade(blade.length, blade.breadth, blade.lobes, count)


def _scaled_fan(
    habit: Habit, foot: FloatArray, scale: float, rng: np.random.Generator
) -> list[Twig]:
    small = Habit(
        habit.stems, scale * habit.length, habit.sides, habit.angle, habit.reach, habit.droop,
        habit.wander, habit.width * scale**0.5,
    )  # fmt: skip
    return fan(small, foot, 0.0, rng)


def _foliage(canvas: Canvas, colour: Colour) -> FloatArray:
    shade, leaf, opacity = canvas.layers()
    tint = leaf[..., None] * np.array(colour) + (1.0 - leaf[..., None]) * np.array(_STEM)
    return np.concatenate([shade[..., None] * tint, opacity[..., None]], axis=2)


def _blossoms(canvas: Canvas, colour: Colour) -> FloatArray:
    shade, petal, opacity = canvas.layers()
    tint = petal[..., None] * np.array(colour) + (1.0 - petal[..., None]) * np.array(_CENTRE)
    return np.concatenate([shade[..., None] * tint, opacity[..., None]], axis=2)


def _composed(layers: Sequence[FloatArray], mean: Colour) -> FloatArray:
    """Later layers over earlier ones; what is not drawn has the mean colour."""
    colour = np.broadcast_to(np.array(mean), (TILE, TILE, 3))
    opacity = np.zeros((TILE, TILE))
    for layer in layers:
        over = layer[..., 3]
        colour = np.where(
            over[..., None] > 0, layer[..., :3] * over[..., None] + colour * (1 - over[..., None]),
            colour,
        )  # fmt: skip
        opacity = np.maximum(opacity, over)
    return np.concatenate([colour, opacity[..., None]], axis=2)


def _paint_blossoms(
    canvas: Canvas, twigs: Sequence[Twig], plant: _Plant, scale: float, rng: np.random.Generator
) -> None:
    """Blossoms at the ends of the upper stems, the lower ones first."""
    tips = np.array([twig.points[-1] for twig in twigs])
    low = tips[:, 1].min() + _LEAST_HEIGHT * np.ptp(tips[:, 1])
    tips = tips[tips[:, 1] > low]
    chosen = tips[rng.permutation(len(tips))[: plant.blossoms]]
    for place in chosen[np.argsort(chosen[:, 1])]:
        if np.hypot(*(place - 0.5)) > 0.44:
            continue
        radius = scale * plant.radius * rng.uniform(0.75, 1.2)
        _paint_blossom(canvas, place, radius, plant.count, rng)


def _paint_blossom(
    canvas: Canvas, place: FloatArray, radius: float, petals: int, rng: np.random.Generator
) -> None:
    """Petals around a centre, seen at an angle."""
    flat, turn = rng.uniform(0.6, 1.0), rng.uniform(0.0, 2 * np.pi)
    squash = np.array([1.0, flat])
    t = np.linspace(0.0, 2 * np.pi, 9)[:-1]
    for number in range(petals):
        angle = turn + 2 * np.pi * number / petals
        ahead = np.array([np.cos(angle), np.sin(angle)])
        aside = np.array([-ahead[1], ahead[0]])
        wide = 1.9 / petals + 0.12
        oval = 0.55 * ahead + 0.45 * np.cos(t)[:, None] * ahead + wide * np.sin(t)[:, None] * aside
        # The upper petals face the sky.
        shade = (0.92 + 0.18 * np.sin(angle)) * float(np.exp(rng.normal(0, 0.10)))
        canvas.polygon(place + radius * oval * squash, shade)
    end = np.array([0.18 * radius, 0.0])
    canvas.line(Twig(np.stack([place - end, place + end]), np.array([0.36 * radius] * 2)), 1.0)
