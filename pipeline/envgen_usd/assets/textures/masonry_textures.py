"""Textures of stone, brick, concrete and plaster."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Texture
from envgen_usd.assets.textures.texture_noise import (
    cells,
    even_seeds,
    grid,
    mix,
    smoothstep,
    spectral,
    tint,
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


def brick_red(rng: np.random.Generator) -> Texture:
    """Red stretcher bond: bricks 0.24 x 0.071 m (DIN 105 NF) in 10 to 12 mm of mortar."""
    wall = bond(FINE, 2.0, 8, 24)
    rough = 0.0012 * spectral(rng, FINE, 30, 250, 0.8)
    brick = smoothstep(0.0045, 0.0072, wall.border + rough)
    colour = np.array([0.285, 0.098, 0.062]) * np.exp(rng.normal(0, 0.16, (wall.count, 1)))
    colour *= np.exp(rng.normal(0, 0.07, (wall.count, 3)))
    burnt = rng.random(wall.count) < 0.08
    colour[burnt] *= np.array([0.55, 0.60, 0.72])
    grain = np.exp(0.13 * spectral(rng, FINE, 20, 300, 0.7))
    mortar = tint((0.36, 0.335, 0.29), np.exp(0.10 * spectral(rng, FINE, 15, 300, 0.5)))
    grime = np.exp(0.06 * spectral(rng, FINE, 3, 20, 1.0))
    albedo = mix(mortar, colour[wall.index] * grain[..., None], brick) * grime[..., None]
    height = 0.006 * brick + 0.0007 * spectral(rng, FINE, 20, 300, 0.7)
    return Texture(2.0, albedo, height)


def flagstone(rng: np.random.Generator) -> Texture:
    """Wall of irregular split stones, wider than tall, in light mortar."""
    aspect, count = 1.8, 74
    wobble = np.stack([spectral(rng, FINE, 4, 40, 1.3) for _ in range(2)], axis=-1) * 0.004
    stones = cells(even_seeds(rng, count, aspect), FINE, aspect, wobble)
    inside = stones.border * 3.0 / 1.0
    stone = smoothstep(0.009, 0.022, inside + 0.003 * spectral(rng, FINE, 15, 120, 1.0))
    palette = np.array(
        [[0.30, 0.255, 0.19], [0.24, 0.21, 0.17], [0.34, 0.30, 0.24], [0.20, 0.19, 0.175]]
    )
    colour = palette[rng.integers(4, size=count)] * np.exp(rng.normal(0, 0.12, (count, 1)))
    layers = np.exp(0.16 * spectral(rng, FINE, 4, 300, 0.8, (1.0, 0.35)))
    mortar = tint((0.33, 0.31, 0.27), np.exp(0.10 * spectral(rng, FINE, 12, 300, 0.5)))
    albedo = mix(mortar, colour[stones.index] * layers[..., None], stone)
    bulge = np.sqrt(np.clip(inside / 0.12, 0, 1))
    height = 0.016 * stone + 0.008 * bulge + 0.004 * spectral(rng, FINE, 5, 120, 1.1)
    return Texture(4.0, albedo, height)


def paving(rng: np.random.Generator) -> Texture:
    """Concrete slabs of 0.5 x 0.5 m, laid half a slab apart."""
    slabs = bond(SIZE, 2.0, 4, 4)
    top = smoothstep(0.002, 0.006, slabs.border)
    tone = np.exp(rng.normal(0, 0.07, slabs.count))[slabs.index]
    speckle = np.exp(0.10 * spectral(rng, SIZE, 40, 250, 0.2))
    stain = np.exp(0.07 * spectral(rng, SIZE, 3, 30, 1.0))
    face = tint((0.285, 0.275, 0.255), tone * speckle * stain)
    joint = tint((0.10, 0.093, 0.078), np.exp(0.2 * spectral(rng, SIZE, 20, 250, 0.4)))
    height = 0.005 * top + 0.0005 * spectral(rng, SIZE, 40, 250, 0.2)
    return Texture(2.0, mix(joint, face, top), height)


def curb_stone(rng: np.random.Generator) -> Texture:
    """Granite kerb in pieces of 1 m."""
    pieces = bond(SIZE, 2.0, 2, 1, shift=0.0)
    edge = np.minimum(pieces.u, 1 - pieces.u) * 1.0
    joint = 1 - smoothstep(0.003, 0.008, edge)
    speckle = np.exp(0.24 * spectral(rng, SIZE, 60, 256, 0.1))
    stain = np.exp(0.08 * spectral(rng, SIZE, 3, 30, 1.0))
    albedo = tint((0.30, 0.295, 0.285), speckle * stain * (1 - 0.65 * joint))
    return Texture(2.0, albedo, -0.005 * joint + 0.0006 * spectral(rng, SIZE, 60, 256, 0.1))


def concrete(rng: np.random.Generator) -> Texture:
    """Fair-faced concrete with pores and faint formwork boards."""
    boards = bond(SIZE, 4.0, 2, 8, shift=0.5)
    tone = np.exp(rng.normal(0, 0.035, boards.count))[boards.index]
    seam = 1 - smoothstep(0.003, 0.012, boards.border)
    pores = smoothstep(2.3, 2.9, spectral(rng, SIZE, 30, 200, 0.1))
    cloud = np.exp(0.07 * spectral(rng, SIZE, 3, 60, 1.2) + 0.05 * spectral(rng, SIZE, 60, 250, 0))
    albedo = tint((0.33, 0.325, 0.31), tone * cloud * (1 - 0.22 * seam) * (1 - 0.45 * pores))
    return Texture(4.0, albedo, -0.004 * pores - 0.002 * seam)


def plaster(rng: np.random.Generator) -> Texture:
    """Rendered wall, off-white, scratched."""
    grain = spectral(rng, SIZE, 40, 220, 0.3)
    cloud = np.exp(0.035 * spectral(rng, SIZE, 3, 24, 1.0) + 0.035 * grain)
    return Texture(2.5, tint((0.58, 0.55, 0.48), cloud), 0.0018 * grain)
