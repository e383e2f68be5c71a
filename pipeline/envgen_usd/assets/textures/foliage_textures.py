"""Foliage textures with opacity cut-outs; a card shows a twig with its leaves."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Texture
from envgen_usd.assets.textures.texture_noise import grid, spectral
from envgen_usd.models.array_types import FloatArray

SIZE = 512
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class _Canvas:
    """Canvas: colour S x S x 3 and opacity S x S."""

    colour: FloatArray
    opacity: FloatArray


def _canvas(under: Colour) -> _Canvas:
    colour = np.broadcast_to(np.asarray(under), (SIZE, SIZE, 3)).copy()
    return _Canvas(colour, np.zeros((SIZE, SIZE)))


def _paint_leaf(  # noqa: PLR0913, PLR0917 - pose and look of a leaf
    canvas: _Canvas, foot: FloatArray, angle: float, length: float, width: float, colour: FloatArray
) -> None:
    """Paints a pointed oval with a midrib from its foot; lengths are shares of the side length."""
    tip = foot + length * np.array([np.cos(angle), np.sin(angle)])
    low = np.floor((np.minimum(foot, tip) - width) * SIZE).astype(int).clip(0, SIZE - 1)
    high = np.ceil((np.maximum(foot, tip) + width) * SIZE).astype(int).clip(1, SIZE)
    window = np.s_[low[1] : high[1], low[0] : high[0]]
    u, v = (axis[window] for axis in grid(SIZE))
    along = (u - foot[0]) * np.cos(angle) + (v - foot[1]) * np.sin(angle)
    across = (v - foot[1]) * np.cos(angle) - (u - foot[0]) * np.sin(angle)
    t = np.clip(along / length, 0.0, 1.0)
    half = width * np.sin(np.pi * t**0.75) ** 0.9
    inside = (along > 0) & (along < length) & (np.abs(across) < half)
    side = across[inside] / np.maximum(half[inside], 1e-6)
    light = 0.92 + 0.16 * side - 0.22 * np.exp(-((across[inside] / 0.0018) ** 2))
    canvas.colour[window][inside] = colour * light[:, None]
    canvas.opacity[window][inside] = 1.0


def _twig(rng: np.random.Generator, palette: FloatArray, count: int) -> Texture:
    """Leaves on all sides of a card, dense inside and sparse at the rim."""
    canvas = _canvas(tuple(palette.mean(axis=0) * 0.6))
    for rank in range(count):
        radius = 0.43 * rng.uniform(0.0, 1.0) ** 0.62
        bearing = rng.uniform(0, 2 * np.pi)
        foot = 0.5 + radius * np.array([np.cos(bearing), np.sin(bearing)])
        angle = bearing + rng.normal(0, 0.9)
        length = min(rng.uniform(0.065, 0.115), _room(foot, angle))
        shade = (0.66 + 0.34 * rank / count) * np.exp(rng.normal(0, 0.16))
        colour = palette[rng.integers(len(palette))] * shade
        _paint_leaf(canvas, foot, angle, length, length * rng.uniform(0.24, 0.34), colour)
    grain = np.exp(0.06 * spectral(rng, SIZE, 8, 200, 0.6))
    return Texture(1.0, canvas.colour * grain[..., None], opacity=canvas.opacity)


def _room(foot: FloatArray, angle: float) -> float:
    """Length of a leaf that still ends inside the card."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    ahead = np.where(direction > 0, 0.97 - foot, foot - 0.03) / np.maximum(np.abs(direction), 1e-6)
    return float(max(ahead.min(), 0.02))


def leaves(rng: np.random.Generator) -> Texture:
    """Broad leaves in summer."""
    palette = [[0.098, 0.160, 0.036], [0.118, 0.180, 0.042], [0.080, 0.138, 0.034]]
    return _twig(rng, np.array(palette), 330)


def leaves_autumn(rng: np.random.Generator) -> Texture:
    """Broad leaves in autumn."""
    palette = [[0.40, 0.20, 0.03], [0.36, 0.11, 0.025], [0.44, 0.29, 0.05], [0.20, 0.155, 0.035]]
    return _twig(rng, np.array(palette), 290)


def needles(rng: np.random.Generator) -> Texture:
    """A conifer's branch: a stem along u with drooping twigs of needles on both sides."""
    canvas = _canvas((0.036, 0.058, 0.024))
    base = np.array([0.052, 0.092, 0.036])
    for place in np.linspace(0.03, 0.88, 20):
        reach = 0.46 * (1 - 0.70 * place) + 0.02
        for side in (-1.0, 1.0):
            foot = np.array([place, 0.5])
            angle = side * rng.uniform(0.75, 1.05)
            _paint_twig(rng, canvas, foot, angle, reach * rng.uniform(0.72, 1.0), base)
    _paint_leaf(canvas, np.array([0.0, 0.5]), 0.0, 0.95, 0.006, np.array([0.09, 0.065, 0.04]))
    return Texture(1.0, canvas.colour, opacity=canvas.opacity)


def _paint_twig(  # noqa: PLR0913, PLR0917 - pose and look of a twig
    rng: np.random.Generator,
    canvas: _Canvas,
    foot: FloatArray,
    angle: float,
    length: float,
    base: FloatArray,
) -> None:
    """Paints needles along a line as short strokes that lean forward."""
    count = max(8, int(length * 210))
    along = np.repeat(np.linspace(0.0, length, count), 2)
    lean = angle + np.tile([0.6, -0.6], count) + rng.normal(0, 0.15, 2 * count)
    steps = np.linspace(0.0, 0.038, 28)
    x = foot[0] + (along * np.cos(angle))[:, None] + np.cos(lean)[:, None] * steps
    y = foot[1] + (along * np.sin(angle))[:, None] + np.sin(lean)[:, None] * steps
    px, py = (np.floor(c * SIZE).astype(np.int64) for c in (x, y))
    shade = np.exp(rng.normal(0, 0.25, 2 * count))[:, None] * (0.75 + 0.5 * steps / 0.038)
    inside = (px >= 2) & (px < SIZE - 2) & (py >= 2) & (py < SIZE - 2)
    for dx, dy in ((0, 0), (1, 0), (0, 1)):
        canvas.colour[py[inside] + dy, px[inside] + dx] = base * shade[inside][:, None]
        canvas.opacity[py[inside] + dy, px[inside] + dx] = 1.0
