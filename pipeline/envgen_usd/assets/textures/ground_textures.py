"""Textures of open ground."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.texture_noise import (
    Strokes,
    cells,
    draw_strokes,
    grid,
    mix,
    pick,
    smoothstep,
    spectral,
    tint,
)
from envgen_usd.models.array_types import FloatArray

SIZE = 512


@dataclass(frozen=True)
class Sward:
    """Blades of grass over soil.

    Attributes:
        count: Blades on a tile of 2.5 m.
        length: Least and largest length of a blade, share of the tile's side.
        green: Linear reflectance of a fresh blade.
        dry: Linear reflectance of a dry blade.
        dry_share: Share of dry blades, 0 to 1.
        soil: Linear reflectance of the ground between blades.
        patches: Deviation of the brightness between patches; a larger value gives a rougher look.
        bare: Share of the cover that bare spots lack, 0 to 1.
        depth: Height of the sward in the normal map, metres.
    """

    count: int
    length: tuple[float, float]
    green: Colour
    dry: Colour
    dry_share: float
    soil: Colour
    patches: float
    bare: float
    depth: float


GRASS = Sward(
    26000,
    (0.015, 0.045),
    (0.098, 0.142, 0.044),
    (0.21, 0.19, 0.085),
    0.08,
    (0.045, 0.038, 0.024),
    0.10,
    0.0,
    0.02,
)
LUSH = replace(GRASS, count=30000, green=(0.070, 0.128, 0.030), dry_share=0.02)
DRY = replace(GRASS, green=(0.135, 0.140, 0.058), dry_share=0.45, patches=0.15, bare=0.25)
MEADOW = replace(
    GRASS,
    length=(0.03, 0.08),
    green=(0.112, 0.140, 0.050),
    dry_share=0.22,
    patches=0.16,
    depth=0.05,
)
VERGE = Sward(
    19000,
    (0.010, 0.032),
    (0.098, 0.136, 0.042),
    (0.22, 0.19, 0.09),
    0.14,
    (0.085, 0.070, 0.048),
    0.0,
    0.55,
    0.012,
)
LAWN = Sward(
    34000,
    (0.006, 0.018),
    (0.098, 0.160, 0.046),
    (0.17, 0.18, 0.07),
    0.03,
    (0.045, 0.050, 0.022),
    0.05,
    0.0,
    0.010,
)


def grass(rng: np.random.Generator, look: Sward) -> Texture:
    """Blades of grass over soil, seen from above."""
    albedo, height, cover = _blades(rng, look)
    patch = np.exp(look.patches * spectral(rng, SIZE, 3, 14, 1.0))
    bare = smoothstep(0.5, 1.5, spectral(rng, SIZE, 4, 30, 1.0))
    soil = tint(look.soil, np.exp(0.3 * spectral(rng, SIZE, 20, 200, 0.5)))
    ground = mix(soil, albedo, cover * (1 - look.bare * bare)) * patch[..., None]
    return Texture(2.5, ground, look.depth * height, 0.97 - 0.10 * cover * height)


def _blades(rng: np.random.Generator, look: Sward) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Blades: albedo S x S x 3, height 0 to 1, and whether any blade covers a pixel."""
    count = look.count
    strokes = Strokes(
        rng.random((count, 2)),
        rng.uniform(0, 2 * np.pi, count),
        rng.normal(0, 0.7, count),
        rng.uniform(*look.length, count),
        rng.uniform(1.0, 2.2, count),
    )
    steps = max(22, int(0.8 * look.length[1] * SIZE))
    owner, along = draw_strokes(strokes, SIZE, steps)
    depth = np.where(owner >= 0, owner / count, 0.0)
    colour = np.asarray(look.green) * np.exp(rng.normal(0, 0.22, (count, 1)))
    colour *= np.exp(rng.normal(0, 0.10, (count, 3)))
    colour[rng.random(count) < look.dry_share] = np.asarray(look.dry)
    light = (0.35 + 0.65 * depth) * (0.8 + 0.35 * along)
    albedo = colour[np.maximum(owner, 0)] * light[..., None]
    return albedo, depth * (0.4 + 0.6 * along), (owner >= 0).astype(float)


def _stones(
    rng: np.random.Generator, count: int, palette: tuple[Colour, ...], spread: float
) -> tuple[FloatArray, FloatArray]:
    """Loose stones: albedo S x S x 3, and the height of each pixel, 0 to 1."""
    wobble = np.stack([spectral(rng, SIZE, 10, 90, 1.2) for _ in range(2)], axis=-1)
    seeds = rng.random((count, 2))
    stones = cells(seeds, SIZE, wobble=wobble * 0.25 / np.sqrt(count))
    radius = 0.30 / np.sqrt(count)
    dome = np.sqrt(np.clip(stones.border / radius, 0, 1))
    colour = pick(rng, palette, count) * np.exp(rng.normal(0, spread, (count, 1)))
    colour *= np.exp(rng.normal(0, 0.06, (count, 3)))
    grain = np.exp(0.16 * spectral(rng, SIZE, 30, 250, 0.4))
    return colour[stones.index] * (grain * (0.35 + 0.65 * dome))[..., None], dome


def gravel(rng: np.random.Generator) -> Texture:
    """Gravel of 1 to 4 cm."""
    albedo, dome = _stones(rng, 9000, ((0.26, 0.245, 0.22),), 0.30)
    return Texture(2.5, albedo, 0.010 * dome, 0.97 - 0.08 * dome)


@dataclass(frozen=True)
class Rubble:
    """Stones of all sizes in fines.

    Attributes:
        stones: Linear reflectances of the coarse stones, equally likely.
        fines: Linear reflectance of the fines.
    """

    stones: tuple[Colour, ...]
    fines: Colour


DUSTY = Rubble(((0.23, 0.21, 0.185),), (0.21, 0.185, 0.155))
BROKEN_BRICK = Rubble(
    ((0.25, 0.115, 0.075), (0.30, 0.15, 0.10), (0.27, 0.25, 0.22)), (0.21, 0.155, 0.12)
)
CRUSHED_CONCRETE = Rubble(
    ((0.32, 0.315, 0.30), (0.26, 0.255, 0.245), (0.38, 0.37, 0.35)), (0.29, 0.28, 0.26)
)


def rubble(rng: np.random.Generator, look: Rubble) -> Texture:
    """Compacted rubble of an industrial yard: stones of all sizes in dusty fines."""
    coarse, dome = _stones(rng, 1300, look.stones, 0.32)
    fine, grit = _stones(rng, 12000, (look.fines,), 0.25)
    buried = smoothstep(-0.5, 0.5, spectral(rng, SIZE, 5, 60, 0.7) + 1.2 * (0.55 - dome))
    dust = np.exp(0.10 * spectral(rng, SIZE, 3, 20, 1.0))
    height = 0.025 * dome * (1 - buried) + 0.005 * grit
    albedo = mix(coarse, fine, buried) * dust[..., None]
    return Texture(4.0, albedo, height, 0.90 + 0.08 * buried)


def forest_floor(rng: np.random.Generator) -> Texture:
    """Leaf litter under herbs, brambles and moss, which cover most of it."""
    herbs = smoothstep(-1.4, 0.0, spectral(rng, SIZE, 3, 40, 0.9))
    count = 6000
    strokes = Strokes(
        rng.random((count, 2)),
        rng.uniform(0, 2 * np.pi, count),
        rng.normal(0, 0.5, count),
        rng.uniform(0.012, 0.034, count),
        rng.uniform(2.0, 7.0, count),
    )
    owner, along = draw_strokes(strokes, SIZE, 18)
    browns = np.array([[0.12, 0.075, 0.04], [0.085, 0.06, 0.038], [0.16, 0.11, 0.06]])
    greens = np.array([[0.066, 0.118, 0.03], [0.092, 0.15, 0.042], [0.05, 0.092, 0.028]])
    column, row = np.minimum((strokes.start * SIZE).astype(int), SIZE - 1).T
    green = rng.random(count) < 0.08 + 0.85 * herbs[row, column]
    shades = rng.integers(3, size=count)
    colour = np.where(green[:, None], greens[shades], browns[shades])
    colour *= np.exp(rng.normal(0, 0.25, (count, 1)))
    depth = np.maximum(owner, 0) / count
    litter = colour[np.maximum(owner, 0)] * (0.45 + 0.55 * depth + 0.1 * along)[..., None]
    soil = tint((0.05, 0.038, 0.025), np.exp(0.3 * spectral(rng, SIZE, 20, 200, 0.5)))
    moss = smoothstep(0.6, 1.6, spectral(rng, SIZE, 4, 40, 1.0))
    albedo = mix(soil, litter, (owner >= 0).astype(float))
    mossy = tint((0.055, 0.08, 0.022), np.exp(0.3 * spectral(rng, SIZE, 30, 220, 0.3)))
    return Texture(2.5, mix(albedo, mossy, 0.6 * moss), 0.02 * depth)


@dataclass(frozen=True)
class Rows:
    """Rows along u on a tile of 4 m, of bare earth or of plants.

    Attributes:
        count: Rows on a tile.
        depth: Height of the ridges, metres.
        plants: Blades on a tile; 0 for bare earth.
        green: Linear reflectance of a blade.
        width: Width of a row of plants, share of the distance of rows.
    """

    count: int
    depth: float
    plants: int = 0
    green: Colour = (0.0, 0.0, 0.0)
    width: float = 0.5


FURROWS = Rows(7, 0.14)
SOWN = Rows(5, 0.03, plants=26000, green=(0.082, 0.126, 0.036))


def rows(rng: np.random.Generator, look: Rows) -> Texture:
    """A ploughed or a sown field: ridges of crumbs and clods, and plants on them."""
    clods, dome = _stones(rng, 3200, ((0.110, 0.082, 0.058), (0.136, 0.102, 0.072)), 0.25)
    bend = 0.06 * spectral(rng, SIZE, 1, 12, 1.2)
    v = grid(SIZE)[1] * look.count + bend
    ridge = 0.5 + 0.5 * np.cos(2 * np.pi * v)
    light = 0.55 + 0.55 * ridge
    earth = clods * (light * np.exp(0.12 * spectral(rng, SIZE, 3, 20, 1.0)))[..., None]
    height = look.depth * ridge + 0.035 * dome
    if not look.plants:
        return Texture(4.0, earth, height)
    blades, tall, cover = _blades(rng, _sown(look))
    # Gaps where seeds failed, and leaves of many lengths at the edge of a row.
    edge = spectral(rng, SIZE, 20, 160, 0.5)
    grown = smoothstep(1 - look.width, 1.25 - look.width, ridge + 0.12 * edge)
    grown = grown * cover
    albedo = mix(earth, blades, grown)
    return Texture(4.0, albedo, height + 0.08 * grown * tall, 0.97 - 0.08 * grown)


def _sown(look: Rows) -> Sward:
    return replace(
        GRASS, count=look.plants, length=(0.012, 0.035), green=look.green, dry_share=0.02
    )


def soil(rng: np.random.Generator) -> Texture:
    """Dug earth: crumbs and clods, moist and therefore dark."""
    clods, dome = _stones(rng, 2600, ((0.110, 0.082, 0.058), (0.136, 0.102, 0.072)), 0.22)
    crumbs, grit = _stones(rng, 14000, ((0.104, 0.078, 0.055),), 0.25)
    buried = smoothstep(-0.3, 0.7, spectral(rng, SIZE, 5, 50, 0.8) + 0.6 * (0.5 - dome))
    height = 0.02 * dome * (1 - buried) + 0.006 * grit
    return Texture(2.5, mix(clods, crumbs, buried), height)
