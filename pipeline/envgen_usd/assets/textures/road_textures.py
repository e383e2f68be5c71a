"""Textures of asphalt, of its age and repairs, and of road paint."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.texture_noise import (
    cells,
    even_seeds,
    grid,
    mix,
    smoothstep,
    spectral,
    tint,
)
from envgen_usd.models.array_types import FloatArray

FINE = 1024


@dataclass(frozen=True)
class Repair:
    """A rectangle of newer asphalt: its sides as shares of the tile, and its reflectance's factor.

    A utility cut is long and narrow, an opening for a repair about square.
    """

    u: tuple[float, float]
    v: tuple[float, float]
    tone: float


@dataclass(frozen=True)
class Asphalt:
    """Age and repairs of asphalt.

    Attributes:
        colour: Linear reflectance of its surface.
        stones: Deviation of the brightness between stones; worn binder shows more of them.
        stains: Deviation of the brightness between spots of oil, dust and wear.
        cracks: Darkening in cracks, 0 without cracks.
        repairs: Rectangles of newer asphalt.
        size: Side length of the texture, metres.
        side: Side length of the texture, pixels: a multiple of 1024.
        relief: Depth of the texture between stones, metres.
        roughness: Mean roughness, 0 to 1.
    """

    colour: Colour
    stones: float = 0.34
    stains: float = 0.05
    cracks: float = 0.0
    repairs: tuple[Repair, ...] = ()
    size: float = 4.0
    side: int = FINE
    relief: float = 0.0009
    roughness: float = 0.90


_REPAIRS = (
    Repair((0.310, 0.335), (0.05, 0.58), 0.72),
    Repair((0.450, 0.920), (0.700, 0.722), 0.80),
    Repair((0.620, 0.690), (0.300, 0.360), 0.76),
    Repair((0.100, 0.160), (0.720, 0.800), 0.62),
    Repair((0.820, 0.870), (0.120, 0.185), 0.86),
)

FRESH = Asphalt((0.058, 0.058, 0.059), stones=0.28, stains=0.03, roughness=0.82)
ROLLED = Asphalt((0.090, 0.089, 0.087))
WORN = Asphalt((0.122, 0.120, 0.116), stains=0.06, cracks=0.6, relief=0.0012, roughness=0.92)
OLD = replace(WORN, colour=(0.138, 0.135, 0.128), stones=0.40, cracks=0.35, size=8.0)
PATCHED = replace(
    WORN, colour=(0.108, 0.106, 0.102), cracks=0.7, repairs=_REPAIRS, size=20.0, side=2 * FINE
)
FOOTWAY = Asphalt((0.066, 0.065, 0.063), stones=0.24, stains=0.10, relief=0.0006, roughness=0.88)


def asphalt(rng: np.random.Generator, look: Asphalt) -> Texture:
    """Rolled asphalt with aggregate of about 1 cm, or of two pixels where they are larger."""
    low, high = min(15.0 * look.size, look.side / 6), min(105.0 * look.size, look.side / 2)
    stones = spectral(rng, look.side, low, high, 0.2)
    warm = spectral(rng, look.side, low, high, 0.3)
    stain = spectral(rng, look.side, 3.0, 6.0 * look.size, 1.0)
    albedo = tint(look.colour, np.exp(look.stones * stones + look.stains * stain))
    albedo *= 1 + 0.03 * warm[..., None] * np.array([1.0, 0.1, -1.0])
    height = look.relief * spectral(rng, look.side, low, high, 0.4)
    roughness = look.roughness + 0.03 * stain - 0.02 * np.tanh(stones)
    crack = _cracks(rng, look) if look.cracks else np.zeros_like(stones)
    repaired, joint = _repairs(look)
    crack = np.maximum(crack * (repaired == 1.0), 0.6 * joint)
    albedo *= (repaired * (1 - look.cracks * crack))[..., None]
    return Texture(look.size, albedo, height - 0.004 * crack, roughness)


def _cracks(rng: np.random.Generator, look: Asphalt) -> FloatArray:
    """Cracks between cells of 0.8 m, in some places: S x S, 0 to 1."""
    cycles = look.size / 4.0
    wobble = np.stack([spectral(rng, FINE, 4 * cycles, 60 * cycles, 1.2) for _ in range(2)], -1)
    seeds = even_seeds(rng, round(26 * cycles**2))
    border = cells(seeds, FINE, wobble=wobble * 0.012 / cycles).border * look.size
    some = smoothstep(0.2, 0.7, spectral(rng, FINE, 3, 6 * cycles, 1.0))
    crack = (1 - smoothstep(0.0016, 0.0016 + 0.0032 * cycles, border)) * some
    times = look.side // FINE
    return crack.repeat(times, axis=0).repeat(times, axis=1)


def _repairs(look: Asphalt) -> tuple[FloatArray, FloatArray]:
    """Factors of the reflectance in repairs, and their joints: S x S each."""
    u, v = grid(look.side)
    factor, joint = np.ones_like(u), np.zeros_like(u)
    for repair in look.repairs:
        along = np.minimum(u - repair.u[0], repair.u[1] - u)
        across = np.minimum(v - repair.v[0], repair.v[1] - v)
        inside = np.minimum(along, across) * look.size
        factor[inside > 0] = repair.tone
        joint = np.maximum(joint, 1 - smoothstep(0.010, 0.025, np.abs(inside)))
    return factor, joint


def marking(rng: np.random.Generator, look: Colour) -> Texture:
    """Road paint, worn off at the tips of the stones."""
    ground = asphalt(rng, ROLLED)
    chips = spectral(rng, FINE, 50, 400, 0.3) + 0.9 * spectral(rng, FINE, 4, 40, 1.0)
    worn = smoothstep(1.5, 2.6, chips)
    dirt = np.exp(0.06 * spectral(rng, FINE, 4, 120, 0.8))
    albedo = mix(tint(look, dirt), ground.albedo, worn)
    return Texture(4.0, albedo, np.asarray(ground.height) * 0.6, 0.68 + 0.2 * worn)


WHITE_PAINT: Colour = (0.58, 0.58, 0.56)
YELLOW_PAINT: Colour = (0.55, 0.34, 0.035)
"""Near FHWA yellow."""
