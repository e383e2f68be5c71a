"""Textures of stone, paving, concrete and plaster."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.texture_noise import (
    cells,
    even_seeds,
    grid,
    mix,
    pick,
    smoothstep,
    spectral,
    tint,
    weather,
)
from envgen_usd.models.array_types import FloatArray, IntArray

SIZE = 512
FINE = 1024


@dataclass(frozen=True)
class Bond:
    """Rectangular units in courses; every second course is shifted.

    Attributes:
        index: S x S, number of the unit at each pixel.
        border: S x S, distance to the unit's nearest edge, metres.
        u: S x S, 0 to 1 along the unit.
        v: S x S, 0 to 1 across the unit.
        count: Number of units.
    """

    index: IntArray
    border: FloatArray
    u: FloatArray
    v: FloatArray
    count: int


def bond(size: int, metres: float, columns: int, courses: int, shift: float = 0.5) -> Bond:
    """Lays `courses` (an even number, unless shift is 0) of `columns` units over a tile."""
    u, v = grid(size)
    course = np.floor(v * courses).astype(np.int64)
    along = (u * columns + shift * (course % 2)) % columns
    column = np.floor(along).astype(np.int64)
    fu, fv = along - column, v * courses - course
    du = np.minimum(fu, 1 - fu) * metres / columns
    dv = np.minimum(fv, 1 - fv) * metres / courses
    return Bond(course * columns + column, np.minimum(du, dv), fu, fv, columns * courses)


@dataclass(frozen=True)
class Stone:
    """Colours of a stone wall: of its stones, equally likely, and of its mortar."""

    stones: tuple[Colour, ...]
    mortar: Colour


TAN = Stone(
    ((0.30, 0.255, 0.19), (0.24, 0.21, 0.17), (0.34, 0.30, 0.24), (0.20, 0.19, 0.175)),
    (0.33, 0.31, 0.27),
)
GREY = Stone(
    ((0.25, 0.25, 0.245), (0.19, 0.19, 0.19), (0.31, 0.305, 0.29), (0.22, 0.21, 0.195)),
    (0.30, 0.295, 0.28),
)
SANDSTONE = Stone(
    ((0.30, 0.185, 0.125), (0.25, 0.16, 0.115), (0.35, 0.235, 0.165), (0.27, 0.205, 0.155)),
    (0.34, 0.30, 0.25),
)


def flagstone(rng: np.random.Generator, look: Stone) -> Texture:
    """Wall of irregular split stones, wider than tall, in light mortar."""
    aspect, count = 1.8, 74
    wobble = np.stack([spectral(rng, FINE, 4, 40, 1.3) for _ in range(2)], axis=-1) * 0.004
    stones = cells(even_seeds(rng, count, aspect), FINE, aspect, wobble)
    inside = stones.border * 3.0 / 1.0
    stone = smoothstep(0.009, 0.022, inside + 0.003 * spectral(rng, FINE, 15, 120, 1.0))
    colour = pick(rng, look.stones, count) * np.exp(rng.normal(0, 0.12, (count, 1)))
    layers = np.exp(0.16 * spectral(rng, FINE, 4, 300, 0.8, (1.0, 0.35)))
    mortar = tint(look.mortar, np.exp(0.10 * spectral(rng, FINE, 12, 300, 0.5)))
    dirt = weather(rng, FINE, 0.10)
    albedo = mix(mortar, colour[stones.index] * layers[..., None], stone) * dirt[..., None]
    bulge = np.sqrt(np.clip(inside / 0.12, 0, 1))
    height = 0.016 * stone + 0.008 * bulge + 0.004 * spectral(rng, FINE, 5, 120, 1.1)
    return Texture(4.0, albedo, height, 0.95 - 0.09 * stone)


_ASHLARS = ((0.300, 0.275, 0.225), (0.270, 0.250, 0.210), (0.335, 0.305, 0.245))
"""Linear reflectances of limestone blocks, equally likely."""


def ashlar(rng: np.random.Generator) -> Texture:
    """Wall of dressed blocks of 0.67 by 0.33 m in thin joints."""
    blocks = bond(FINE, 4.0, 6, 12)
    face = smoothstep(0.002, 0.006, blocks.border)
    margin = smoothstep(0.018, 0.026, blocks.border)
    colour = pick(rng, _ASHLARS, blocks.count) * np.exp(rng.normal(0, 0.08, (blocks.count, 1)))
    tooling = spectral(rng, FINE, 60, 400, 0.3, (1.0, 0.4))
    grain = np.exp(0.06 * spectral(rng, FINE, 6, 120, 1.0) + 0.07 * margin * tooling)
    dirt = weather(rng, FINE, 0.10)
    joint = tint((0.235, 0.220, 0.190), np.exp(0.10 * spectral(rng, FINE, 20, 300, 0.5)))
    albedo = mix(joint, colour[blocks.index] * grain[..., None], face) * dirt[..., None]
    height = 0.004 * face + 0.003 * margin + 0.0006 * margin * tooling
    return Texture(4.0, albedo, height, 0.93 - 0.05 * face + 0.02 * margin)


@dataclass(frozen=True)
class Slabs:
    """Rectangular slabs or pavers with joints.

    Attributes:
        face: Linear reflectance of the slabs.
        joint: Linear reflectance of the joints.
        columns: Units along a tile of 4 m.
        courses: Units across a tile; even.
        spread: Deviation of the brightness between units.
        stains: Deviation of the brightness between spots.
        spots: Share of small dark spots, such as chewing gum.
    """

    face: Colour
    joint: Colour
    columns: int
    courses: int
    spread: float = 0.10
    stains: float = 0.09
    spots: float = 0.4


FLAGS = Slabs((0.158, 0.152, 0.139), (0.070, 0.066, 0.056), 6, 8)
SETTS = Slabs((0.140, 0.138, 0.132), (0.080, 0.076, 0.068), 20, 40, spread=0.16, spots=0.0)
PALE_SLABS = Slabs((0.285, 0.275, 0.255), (0.10, 0.093, 0.078), 8, 8, spread=0.07)


def paving(rng: np.random.Generator, look: Slabs) -> Texture:
    """Concrete slabs or pavers, laid half a unit apart."""
    slabs = bond(FINE, 4.0, look.columns, look.courses)
    top = smoothstep(0.002, 0.008, slabs.border)
    tone = np.exp(rng.normal(0, look.spread, slabs.count))[slabs.index]
    speckle = np.exp(0.12 * spectral(rng, FINE, 80, 450, 0.2))
    stain = spectral(rng, FINE, 3, 40, 1.0)
    spot = look.spots * smoothstep(2.9, 3.3, spectral(rng, FINE, 40, 90, 0.2))
    face = tint(look.face, tone * speckle * np.exp(look.stains * stain) * (1 - spot))
    joint = tint(look.joint, np.exp(0.2 * spectral(rng, FINE, 40, 450, 0.4)))
    height = 0.005 * top + 0.0005 * spectral(rng, FINE, 80, 450, 0.2)
    return Texture(4.0, mix(joint, face, top), height, 0.95 - 0.08 * top + 0.02 * stain)


GRANITE: Colour = (0.235, 0.230, 0.222)
CAST_KERB: Colour = (0.180, 0.175, 0.162)


def kerb(rng: np.random.Generator, look: Colour) -> Texture:
    """Kerb in pieces of 1 m."""
    pieces = bond(SIZE, 2.0, 2, 1, shift=0.0)
    edge = np.minimum(pieces.u, 1 - pieces.u) * 1.0
    joint = 1 - smoothstep(0.003, 0.008, edge)
    speckle = np.exp(0.24 * spectral(rng, SIZE, 60, 256, 0.1))
    stain = np.exp(0.12 * spectral(rng, SIZE, 3, 30, 1.0))
    tone = np.exp(rng.normal(0, 0.10, pieces.count))[pieces.index]
    albedo = tint(look, tone * speckle * stain * (1 - 0.65 * joint))
    height = -0.005 * joint + 0.0006 * spectral(rng, SIZE, 60, 256, 0.1)
    return Texture(2.0, albedo, height, 0.80 + 0.12 * joint)


def concrete(rng: np.random.Generator) -> Texture:
    """Fair-faced concrete with pores and faint formwork boards."""
    boards = bond(SIZE, 4.0, 2, 8, shift=0.5)
    tone = np.exp(rng.normal(0, 0.05, boards.count))[boards.index]
    seam = 1 - smoothstep(0.003, 0.012, boards.border)
    pores = smoothstep(2.3, 2.9, spectral(rng, SIZE, 30, 200, 0.1))
    cloud = 0.07 * spectral(rng, SIZE, 3, 60, 1.2) + 0.05 * spectral(rng, SIZE, 60, 250, 0)
    dirt = weather(rng, SIZE, 0.10) * np.exp(cloud)
    albedo = tint((0.305, 0.300, 0.285), tone * dirt * (1 - 0.22 * seam) * (1 - 0.45 * pores))
    return Texture(4.0, albedo, -0.004 * pores - 0.002 * seam, 0.85 + 0.5 * cloud)


PLASTERS: dict[str, Colour] = {
    "plaster": (0.58, 0.55, 0.48),
    "plaster_white": (0.72, 0.71, 0.68),
    "plaster_cream": (0.62, 0.54, 0.40),
    "plaster_ochre": (0.48, 0.35, 0.18),
    "plaster_pink": (0.50, 0.36, 0.29),
    "plaster_grey": (0.31, 0.31, 0.30),
    "plaster_green": (0.37, 0.41, 0.32),
    "plaster_blue": (0.38, 0.44, 0.50),
}
"""Linear reflectance of painted render, by material."""


def plaster(rng: np.random.Generator, look: Colour) -> Texture:
    """Rendered and painted wall, scratched, with streaks of dirt."""
    grain = spectral(rng, SIZE, 64, 250, 0.3)
    dirt = weather(rng, SIZE, 0.07) * np.exp(0.035 * grain)
    return Texture(4.0, tint(look, dirt), 0.0018 * grain, 0.92 + 0.02 * grain)


_COBBLES = ((0.275, 0.265, 0.250), (0.240, 0.235, 0.230), (0.285, 0.255, 0.225))
"""Linear reflectances of field stones, equally likely."""


def cobble(rng: np.random.Generator) -> Texture:
    """Rounded field stones of about 12 cm in sand and dirt."""
    wobble = np.stack([spectral(rng, FINE, 6, 40, 1.2) for _ in range(2)], axis=-1)
    stones = cells(even_seeds(rng, 280), FINE, wobble=0.004 * wobble)
    dome = np.sqrt(np.clip(stones.border / 0.020, 0.0, 1.0))
    shown = smoothstep(0.25, 0.55, dome)
    colour = pick(rng, _COBBLES, 280) * np.exp(rng.normal(0.0, 0.16, (280, 1)))
    grain = np.exp(0.10 * spectral(rng, FINE, 40, 400, 0.3))
    worn = (grain * (0.75 + 0.30 * dome))[..., None]
    joints = tint((0.120, 0.108, 0.088), np.exp(0.15 * spectral(rng, FINE, 60, 450, 0.2)))
    albedo = mix(joints, colour[stones.index] * worn, shown)
    return Texture(2.0, albedo, 0.022 * dome, 0.92 - 0.22 * shown)


def rough_cast(rng: np.random.Generator) -> Texture:
    """Render with pebbles of 4 to 8 mm thrown into it, painted over once."""
    wobble = np.stack([spectral(rng, FINE, 20, 200, 1.0) for _ in range(2)], axis=-1)
    pebbles = cells(rng.random((40000, 2)), FINE, wobble=0.0008 * wobble)
    bump = np.sqrt(np.clip(pebbles.border / 0.0022, 0.0, 1.0))
    tone = np.exp(rng.normal(0.0, 0.07, 40000))[pebbles.index] * (0.80 + 0.24 * bump)
    albedo = tint((0.47, 0.44, 0.38), tone * weather(rng, FINE, 0.10))
    return Texture(2.0, albedo, 0.004 * bump, 0.96 - 0.03 * bump)
