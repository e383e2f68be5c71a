"""Textures of asphalt by its age, and of road paint.

Repairs, cracks and tyre tracks follow lanes: the renderer draws them, and no texture has them.
"""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.texture_noise import (
    cells,
    mix,
    pick,
    smoothstep,
    spectral,
    tint,
)
from envgen_usd.models.array_types import FloatArray

FINE = 1024
SIDE = 2.0
"""Side length of the textures, metres."""
_STONES = 46000
"""Stones on a texture: 9 mm from one to the next, as of a surface course of 0/8 to 0/11 mm."""


@dataclass(frozen=True)
class Asphalt:
    """Age of asphalt.

    Attributes:
        colour: Linear reflectance of its surface.
        stones: Deviation of the brightness between stones; worn binder shows more of them.
        binder: Reflectance between stones as a share of that of the stones.
        stains: Deviation of the brightness between spots of 5 cm to 1 m.
    """

    colour: Colour
    stones: float = 0.16
    binder: float = 0.70
    stains: float = 0.045


FRESH = Asphalt((0.063, 0.063, 0.064), stones=0.13, binder=0.82, stains=0.04)
ROLLED = Asphalt((0.098, 0.097, 0.095))
WORN = Asphalt((0.132, 0.130, 0.125), stones=0.19, binder=0.64)
OLD = Asphalt((0.150, 0.147, 0.139), stones=0.22, binder=0.60)
PATCHED = Asphalt((0.116, 0.114, 0.110), stones=0.20, binder=0.64)
FOOTWAY = Asphalt((0.093, 0.092, 0.089), stones=0.12, binder=0.78, stains=0.06)


def asphalt(rng: np.random.Generator, look: Asphalt) -> Texture:
    """Rolled asphalt: stones of 5 to 15 mm in binder."""
    seeds = rng.random((_STONES, 2))
    wobble = np.stack([spectral(rng, FINE, 60, 400, 0.8) for _ in range(2)], axis=-1)
    stones = cells(seeds, FINE, wobble=wobble * 0.0006)
    face = smoothstep(0.0003, 0.0014, stones.border * SIDE)
    greys = pick(rng, ((1.0, 0.99, 0.96), (0.96, 1.0, 1.03), (1.08, 1.0, 0.93)), _STONES)
    colour = greys * np.exp(look.stones * rng.normal(0, 1, (_STONES, 1)))
    stain = spectral(rng, FINE, 3, 40, 1.0)
    light = (look.binder + (1 - look.binder) * face) * np.exp(look.stains * stain)
    albedo = colour[stones.index] * tint(look.colour, light)
    height = 0.0011 * face + 0.0006 * spectral(rng, FINE, 60, 500, 0.3)
    return Texture(SIDE, albedo, height, 0.94 - 0.06 * face + 0.02 * stain)


def marking(rng: np.random.Generator, look: Colour) -> Texture:
    """Road paint, worn off at the tips of the stones."""
    ground = asphalt(rng, ROLLED)
    chips = spectral(rng, FINE, 50, 400, 0.3) + 0.9 * spectral(rng, FINE, 4, 40, 1.0)
    worn = smoothstep(1.5, 2.6, chips)
    dirt: FloatArray = np.exp(0.06 * spectral(rng, FINE, 4, 120, 0.8))
    albedo = mix(tint(look, dirt), ground.albedo, worn)
    return Texture(SIDE, albedo, np.asarray(ground.height) * 0.6, 0.68 + 0.2 * worn)


WHITE_PAINT: Colour = (0.58, 0.58, 0.56)
YELLOW_PAINT: Colour = (0.55, 0.34, 0.035)
"""Near FHWA yellow."""
