"""Textures of clipped hedges, which are bodies and not cards."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.texture_noise import spectral
from envgen_usd.assets.textures.twig_drawing import Canvas
from envgen_usd.models.array_types import FloatArray

SIZE = 512


@dataclass(frozen=True)
class HedgeLook:
    """A clipped hedge.

    Attributes:
        leaf: Reflectance of a leaf.
        other: Reflectance of some of the leaves: young, or dry.
        share: Share of those.
        length: Range of lengths of a leaf, metres.
        count: Leaves on a square metre.
    """

    leaf: Colour
    other: Colour
    share: float
    length: tuple[float, float]
    count: int


PRIVET = HedgeLook((0.090, 0.116, 0.050), (0.135, 0.150, 0.066), 0.15, (0.030, 0.055), 2600)
BEECH = HedgeLook((0.190, 0.122, 0.070), (0.110, 0.110, 0.052), 0.25, (0.030, 0.055), 3000)
"""Beech keeps its dry leaves through the winter."""


def hedge(rng: np.random.Generator, look: HedgeLook) -> Texture:
    """Leaves over the dark inside of a hedge."""
    groups = rng.random(look.count) < look.share
    layers = [_leaves(rng, look, int(count)) for count in (np.sum(~groups), np.sum(groups))]
    colour = np.full((SIZE, SIZE, 3), 0.022) * np.array([1.0, 1.0, 0.8])
    height = np.zeros((SIZE, SIZE))
    for (shade, opacity), tint in zip(layers, (look.leaf, look.other), strict=True):
        fresh = shade[..., None] * np.array(tint)
        colour += opacity[..., None] * (fresh - colour)
        height = np.maximum(height, 0.02 * opacity * shade)
    patches = np.exp(0.22 * spectral(rng, SIZE, 2, 12, 1.0))
    return Texture(1.0, colour * patches[..., None], height, 0.8 - 4.0 * height)


def _leaves(rng: np.random.Generator, look: HedgeLook, count: int) -> tuple[FloatArray, FloatArray]:
    """Shade and opacity of leaves that lie over the border too: S x S each."""
    canvas = Canvas(SIZE)
    t = np.linspace(0.0, 1.0, 7)
    for rank in range(count):
        place, heading = rng.random(2), rng.uniform(0, 2 * np.pi)
        length = rng.uniform(*look.length)
        ahead = np.array([-np.sin(heading), np.cos(heading)])
        aside = np.array([ahead[1], -ahead[0]])
        half = 0.27 * length * np.sin(np.pi * t**0.8)
        spine = place + length * t[:, None] * ahead
        shade = (0.45 + 0.55 * rank / count) * float(np.exp(rng.normal(0, 0.2)))
        for side, light in ((1.0, 1.08), (-1.0, 0.9)):
            blade = np.concatenate([spine, (spine + side * half[:, None] * aside)[::-1]])
            for shift in _repeats(blade):
                canvas.polygon(blade + shift, shade * light)
    shade_map, _, opacity = canvas.layers()
    return shade_map, opacity


def _repeats(blade: FloatArray) -> list[FloatArray]:
    """Shifts by whole pictures at which a leaf shows."""
    shifts = [np.array([x, y]) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)]
    low, high = blade.min(axis=0), blade.max(axis=0)
    return [shift for shift in shifts if ((low + shift < 1.0) & (high + shift > 0.0)).all()]
