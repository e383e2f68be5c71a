"""Textures of brick walls: colours of bricks, of mortar, soot and paint."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.masonry_textures import bond
from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.texture_noise import mix, pick, smoothstep, spectral, tint, weather

FINE = 1024
SIDE = 4.0
"""Side length of the texture, metres; bricks 0.24 x 0.071 m (DIN 105 NF)."""


@dataclass(frozen=True)
class Brick:
    """Look of a brick wall.

    Attributes:
        bricks: Linear reflectances of bricks, equally likely.
        mortar: Linear reflectance of the joints.
        spread: Deviation of the brightness between bricks.
        burnt: Share of overburnt, darker bricks.
        dirt: Deviation of the brightness between spots of the wall.
    """

    bricks: tuple[Colour, ...]
    mortar: Colour
    spread: float = 0.16
    burnt: float = 0.06
    dirt: float = 0.12


RED = Brick(
    ((0.270, 0.120, 0.084), (0.235, 0.108, 0.080), (0.295, 0.135, 0.092)), (0.34, 0.32, 0.28)
)
ORANGE = Brick(((0.370, 0.180, 0.105), (0.330, 0.150, 0.088)), (0.42, 0.39, 0.33), burnt=0.02)
BROWN = Brick(
    ((0.205, 0.135, 0.098), (0.255, 0.165, 0.115), (0.170, 0.118, 0.092)), (0.27, 0.25, 0.22)
)
YELLOW = Brick(
    ((0.400, 0.330, 0.215), (0.350, 0.280, 0.180), (0.430, 0.370, 0.265)), (0.38, 0.35, 0.29)
)
SOOTED = Brick(
    ((0.085, 0.065, 0.054), (0.066, 0.056, 0.050), (0.110, 0.078, 0.060)),
    (0.082, 0.076, 0.068),
    spread=0.22,
    dirt=0.25,
)
PAINTED = Brick(((0.690, 0.680, 0.645),), (0.610, 0.595, 0.555), spread=0.02, burnt=0.0, dirt=0.07)


def brick(rng: np.random.Generator, look: Brick) -> Texture:
    """Stretcher bond with 10 to 12 mm of mortar."""
    wall = bond(FINE, SIDE, 16, 48)
    rough = 0.0012 * spectral(rng, FINE, 60, 400, 0.8)
    face = smoothstep(0.0035, 0.0080, wall.border + rough)
    colour = pick(rng, look.bricks, wall.count) * np.exp(
        rng.normal(0, 1, (wall.count, 1)) * look.spread
    )
    colour *= np.exp(rng.normal(0, 0.3, (wall.count, 3)) * look.spread)
    colour[rng.random(wall.count) < look.burnt] *= np.array([0.50, 0.56, 0.68])
    grain = spectral(rng, FINE, 40, 450, 0.7)
    mortar = tint(look.mortar, np.exp(0.10 * spectral(rng, FINE, 30, 450, 0.5)))
    dirt = weather(rng, FINE, look.dirt)
    albedo = mix(mortar, colour[wall.index] * np.exp(0.11 * grain)[..., None], face)
    height = 0.006 * face + 0.0009 * grain
    tone = rng.normal(0, 0.04, wall.count)[wall.index]
    return Texture(SIDE, albedo * dirt[..., None], height, 0.96 + (tone - 0.12) * face)
