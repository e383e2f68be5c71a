"""Textures of roofs, cladding and wood."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.textures.masonry_textures import bond
from envgen_usd.assets.textures.procedural_texture import Colour, Texture
from envgen_usd.assets.textures.texture_noise import grid, mix, pick, smoothstep, spectral, tint
from envgen_usd.models.array_types import FloatArray

SIZE = 512


def _streaks(rng: np.random.Generator, strength: float) -> FloatArray:
    """Vertical dirt streaks: S x S factors about 1."""
    return np.exp(strength * spectral(rng, SIZE, 3, 120, 0.8, (0.25, 2.5)))


SHEETS: dict[str, Colour] = {
    "sheet_metal": (0.40, 0.425, 0.44),
    "sheet_metal_white": (0.60, 0.60, 0.58),
    "sheet_metal_blue": (0.095, 0.150, 0.250),
    "sheet_metal_green": (0.110, 0.190, 0.145),
}
"""Linear reflectance of painted sheets, by material."""


def sheet_metal(rng: np.random.Generator, look: Colour) -> Texture:
    """Painted trapezoidal sheet: ribs every 0.2 m, 35 mm deep, sheets 2 m tall."""
    u, v = grid(SIZE)
    wave = np.abs((u * 10) % 1.0 - 0.5) * 2
    profile = smoothstep(0.30, 0.55, wave)
    edge = smoothstep(0.22, 0.32, wave) * (1 - smoothstep(0.32, 0.50, wave))
    lap = 1 - smoothstep(0.0015, 0.006, np.minimum(v, 1 - v))
    light = (0.80 + 0.20 * profile) * (1 - 0.14 * edge) * (1 - 0.35 * lap)
    streaks = _streaks(rng, 0.08)
    dirt = streaks * np.exp(0.02 * spectral(rng, SIZE, 20, 250, 0.3))
    screw = _screws(u, v)
    albedo = tint(look, light * dirt * (1 - 0.5 * screw))
    roughness = 0.50 + 0.6 * (1 - streaks) + 0.2 * lap
    return Texture(2.0, albedo, 0.035 * profile + 0.002 * lap, roughness)


def _screws(u: FloatArray, v: FloatArray) -> FloatArray:
    """Screw heads along two lines of a sheet, in every groove: S x S, 0 or 1."""
    du = ((u * 10 + 0.5) % 1.0 - 0.5) / 10
    heads = np.zeros_like(u)
    for line in (0.04, 0.54):
        heads += smoothstep(0.0045, 0.0025, np.hypot(du, v - line))
    return heads


def sheet_metal_roof(rng: np.random.Generator) -> Texture:
    """Standing-seam roof: seams every 0.5 m along the slope."""
    u, _ = grid(SIZE)
    distance = np.abs((u * 4) % 1.0 - 0.5) * 0.5
    seam = 1 - smoothstep(0.006, 0.016, distance)
    shade = 1 - 0.30 * (1 - smoothstep(0.012, 0.04, distance)) * (1 - seam)
    streaks = _streaks(rng, 0.06)
    dirt = streaks * np.exp(0.03 * spectral(rng, SIZE, 10, 250, 0.5))
    albedo = tint((0.215, 0.225, 0.235), shade * dirt * (1 + 0.15 * seam))
    return Texture(2.0, albedo, 0.03 * seam, 0.45 + 0.6 * (1 - streaks))


@dataclass(frozen=True)
class Tiles:
    """Roof tiles: colours, equally likely, deviation of their brightness, and share of lichen."""

    colours: tuple[Colour, ...]
    spread: float
    lichen: float


RED_TILES = Tiles(((0.300, 0.120, 0.068),), 0.13, 0.5)
BROWN_TILES = Tiles(((0.170, 0.108, 0.080), (0.200, 0.128, 0.090)), 0.13, 0.5)
GREY_TILES = Tiles(((0.150, 0.150, 0.150),), 0.08, 0.3)
WEATHERED_TILES = Tiles(
    ((0.270, 0.150, 0.090), (0.200, 0.130, 0.090), (0.160, 0.135, 0.100)), 0.22, 1.0
)


def roof_tiles(rng: np.random.Generator, look: Tiles) -> Texture:
    """Pantiles of clay or concrete: 0.2 m wide, with 0.333 m of each visible."""
    tiles = bond(SIZE, 2.0, 10, 6, shift=0.0)
    arch = 0.5 + 0.5 * np.cos(2 * np.pi * (tiles.u - 0.35))
    lip = smoothstep(0.0, 0.10, tiles.v)
    tone = rng.normal(0, 1, (tiles.count, 1)) * look.spread
    colour = pick(rng, look.colours, tiles.count) * np.exp(tone)
    colour *= np.exp(rng.normal(0, 0.05, (tiles.count, 3)))
    grain = np.exp(0.09 * spectral(rng, SIZE, 10, 250, 0.6))
    lichen = look.lichen * smoothstep(1.2, 2.4, spectral(rng, SIZE, 6, 60, 0.8))
    light = (0.45 + 0.55 * lip) * (0.62 + 0.38 * arch) * grain
    albedo = mix(colour[tiles.index] * light[..., None], tint((0.16, 0.15, 0.11), light), lichen)
    height = 0.045 * arch + 0.022 * (1 - tiles.v) * lip
    return Texture(2.0, albedo, height, 0.90 - 0.08 * lip)


def roof_slate(rng: np.random.Generator) -> Texture:
    """Slates: 0.25 m wide, with 0.2 m of each visible."""
    slates = bond(SIZE, 2.0, 8, 10)
    gap = 1 - smoothstep(0.0012, 0.0045, np.minimum(slates.u, 1 - slates.u) * 0.25)
    lip = smoothstep(0.0, 0.07, slates.v)
    colour = np.array([0.080, 0.086, 0.096]) * np.exp(rng.normal(0, 0.20, (slates.count, 1)))
    colour *= np.exp(rng.normal(0, 0.04, (slates.count, 3)))
    grain = np.exp(0.14 * spectral(rng, SIZE, 6, 250, 0.8, (1.0, 0.5)))
    light = (0.45 + 0.55 * lip) * (1 - 0.55 * gap) * grain
    tone = rng.normal(0, 0.06, slates.count)[slates.index]
    height = 0.010 * (1 - slates.v) * lip
    return Texture(2.0, colour[slates.index] * light[..., None], height, 0.65 + tone + 0.2 * gap)


def roof_shingles(rng: np.random.Generator) -> Texture:
    """Bitumen shingles: tabs of 0.333 x 0.143 m with mineral granules."""
    tabs = bond(SIZE, 2.0, 6, 14)
    gap = 1 - smoothstep(0.003, 0.007, np.minimum(tabs.u, 1 - tabs.u) * 0.333)
    lip = smoothstep(0.0, 0.09, tabs.v)
    colour = np.array([0.120, 0.100, 0.082]) * np.exp(rng.normal(0, 0.20, (tabs.count, 1)))
    granules = np.exp(0.28 * spectral(rng, SIZE, 80, 256, 0.1))
    light = (0.40 + 0.60 * lip) * (1 - 0.55 * gap) * granules
    return Texture(2.0, colour[tabs.index] * light[..., None], 0.006 * (1 - tabs.v) * lip)


def bitumen(rng: np.random.Generator) -> Texture:
    """Roofing felt in sheets of 1 m with overlap."""
    u, _ = grid(SIZE)
    seam = 1 - smoothstep(0.004, 0.014, np.abs((u * 4) % 1.0 - 0.5) * 1.0)
    granules = np.exp(0.22 * spectral(rng, SIZE, 60, 256, 0.1))
    stain = np.exp(0.12 * spectral(rng, SIZE, 3, 24, 1.1))
    return Texture(4.0, tint((0.072, 0.071, 0.070), granules * stain * (1 - 0.4 * seam)))


def wood(rng: np.random.Generator) -> Texture:
    """Vertical boards of 0.125 m, stained."""
    boards = bond(SIZE, 1.0, 8, 1, shift=0.0)
    gap = 1 - smoothstep(0.0015, 0.004, np.minimum(boards.u, 1 - boards.u) * 0.125)
    tone = np.exp(rng.normal(0, 0.10, boards.count))[boards.index]
    grain = np.exp(0.17 * spectral(rng, SIZE, 6, 250, 0.6, (0.2, 4.0)))
    albedo = tint((0.185, 0.105, 0.055), tone * grain * (1 - 0.7 * gap))
    return Texture(1.0, albedo, -0.004 * gap)


BARKS: dict[str, tuple[Colour, float]] = {
    "bark": ((0.135, 0.108, 0.082), 0.35),
    "bark_dark": ((0.085, 0.070, 0.056), 0.30),
    "bark_pale": ((0.280, 0.260, 0.225), 0.62),
    "bark_birch": ((0.560, 0.540, 0.500), 0.55),
}
"""Linear reflectance of the ridges, and its factor in furrows, by material."""


def bark(rng: np.random.Generator, look: tuple[Colour, float]) -> Texture:
    """Furrowed bark."""
    ridges = spectral(rng, SIZE, 5, 120, 0.9, (0.35, 2.0))
    furrow = smoothstep(-0.3, 1.0, ridges)
    grain = np.exp(0.2 * spectral(rng, SIZE, 30, 250, 0.4))
    albedo = tint(look[0], grain * (look[1] + (1 - look[1]) * furrow))
    return Texture(1.0, albedo, 0.02 * furrow, 0.97 - 0.05 * furrow)
