"""Textures of roads and of open ground."""

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Texture
from envgen_usd.assets.textures.texture_noise import (
    Strokes,
    cells,
    draw_strokes,
    even_seeds,
    mix,
    smoothstep,
    spectral,
    tint,
)
from envgen_usd.models.array_types import FloatArray

SIZE = 512
FINE = 1024


def asphalt(rng: np.random.Generator) -> Texture:
    """Rolled asphalt with fine aggregate; reflectance about 0.09."""
    stones = np.exp(0.34 * spectral(rng, FINE, 60, 420, 0.2))
    stain = np.exp(0.03 * spectral(rng, FINE, 3, 24, 1.0))
    warm = spectral(rng, FINE, 40, 300, 0.3)
    albedo = tint((0.102, 0.101, 0.099), stones * stain)
    albedo *= 1 + 0.03 * warm[..., None] * np.array([1.0, 0.1, -1.0])
    height = 0.0009 * spectral(rng, FINE, 60, 420, 0.4)
    return Texture(4.0, albedo, height)


def asphalt_worn(rng: np.random.Generator) -> Texture:
    """Old asphalt: lighter, with hairline cracks and patches."""
    fresh = asphalt(rng)
    patch = smoothstep(0.4, 1.2, spectral(rng, FINE, 3, 12, 1.2))
    albedo = fresh.albedo * 1.35 * (1 - 0.14 * patch[..., None])
    wobble = np.stack([spectral(rng, FINE, 4, 60, 1.2) for _ in range(2)], axis=-1) * 0.012
    cracks = cells(even_seeds(rng, 26), FINE, wobble=wobble)
    some = smoothstep(0.2, 0.7, spectral(rng, FINE, 3, 6, 1.0))
    crack = (1 - smoothstep(0.0004, 0.0012, cracks.border)) * some
    height = np.asarray(fresh.height) * 1.3 - 0.004 * crack
    return Texture(4.0, albedo * (1 - 0.6 * crack[..., None]), height)


def _blades(  # noqa: PLR0913, PLR0917 - what a sward consists of
    rng: np.random.Generator,
    count: int,
    length: tuple[float, float],
    green: tuple[float, float, float],
    dry: tuple[float, float, float],
    dry_share: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sward of blades: albedo S x S x 3, height 0 to 1, and whether any blade covers a pixel."""
    strokes = Strokes(
        rng.random((count, 2)),
        rng.uniform(0, 2 * np.pi, count),
        rng.normal(0, 0.7, count),
        rng.uniform(*length, count),
        rng.uniform(1.0, 2.2, count),
    )
    owner, along = draw_strokes(strokes, SIZE, 22)
    depth = np.where(owner >= 0, owner / count, 0.0)
    colour = np.asarray(green) * np.exp(rng.normal(0, 0.22, (count, 1)))
    colour *= np.exp(rng.normal(0, 0.10, (count, 3)))
    colour[rng.random(count) < dry_share] = np.asarray(dry)
    light = (0.35 + 0.65 * depth) * (0.8 + 0.35 * along)
    albedo = colour[np.maximum(owner, 0)] * light[..., None]
    return albedo, depth * (0.4 + 0.6 * along), (owner >= 0).astype(float)


def grass(rng: np.random.Generator) -> Texture:
    """Meadow grass, unmown, with some dry blades."""
    albedo, height, cover = _blades(
        rng, 26000, (0.015, 0.045), (0.098, 0.142, 0.044), (0.21, 0.19, 0.085), 0.08
    )
    patch = np.exp(0.10 * spectral(rng, SIZE, 3, 14, 1.0))
    soil = tint((0.045, 0.038, 0.024), np.exp(0.3 * spectral(rng, SIZE, 20, 200, 0.5)))
    return Texture(2.5, mix(soil, albedo, cover) * patch[..., None], 0.02 * height)


def grass_verge(rng: np.random.Generator) -> Texture:
    """Roadside grass: shorter, drier, with visible soil."""
    albedo, height, cover = _blades(
        rng, 19000, (0.010, 0.032), (0.098, 0.136, 0.042), (0.22, 0.19, 0.09), 0.14
    )
    bare = smoothstep(0.5, 1.5, spectral(rng, SIZE, 4, 30, 1.0))
    soil = tint((0.085, 0.070, 0.048), np.exp(0.3 * spectral(rng, SIZE, 20, 200, 0.5)))
    return Texture(2.5, mix(soil, albedo, cover * (1 - 0.55 * bare)), 0.012 * height)


def lawn(rng: np.random.Generator) -> Texture:
    """Mown lawn: short blades, even and fresh."""
    albedo, height, cover = _blades(
        rng, 34000, (0.006, 0.018), (0.098, 0.160, 0.046), (0.17, 0.18, 0.07), 0.03
    )
    patch = np.exp(0.05 * spectral(rng, SIZE, 3, 14, 1.0))
    soil = tint((0.045, 0.050, 0.022), np.exp(0.2 * spectral(rng, SIZE, 20, 200, 0.5)))
    return Texture(2.5, mix(soil, albedo, cover) * patch[..., None], 0.010 * height)


def _stones(
    rng: np.random.Generator, count: int, base: tuple[float, float, float], spread: float
) -> tuple[FloatArray, FloatArray]:
    """Loose stones: albedo S x S x 3, and the height of each pixel, 0 to 1."""
    wobble = np.stack([spectral(rng, SIZE, 10, 90, 1.2) for _ in range(2)], axis=-1)
    seeds = rng.random((count, 2))
    stones = cells(seeds, SIZE, wobble=wobble * 0.25 / np.sqrt(count))
    radius = 0.30 / np.sqrt(count)
    dome = np.sqrt(np.clip(stones.border / radius, 0, 1))
    colour = np.asarray(base) * np.exp(rng.normal(0, spread, (count, 1)))
    colour *= np.exp(rng.normal(0, 0.06, (count, 3)))
    grain = np.exp(0.16 * spectral(rng, SIZE, 30, 250, 0.4))
    return colour[stones.index] * (grain * (0.35 + 0.65 * dome))[..., None], dome


def gravel(rng: np.random.Generator) -> Texture:
    """Gravel of 1 to 4 cm."""
    albedo, dome = _stones(rng, 9000, (0.26, 0.245, 0.22), 0.30)
    return Texture(2.5, albedo, 0.010 * dome)


def rubble(rng: np.random.Generator) -> Texture:
    """Compacted rubble of an industrial yard: stones of all sizes in dusty fines."""
    coarse, dome = _stones(rng, 1300, (0.23, 0.21, 0.185), 0.32)
    fine, grit = _stones(rng, 12000, (0.21, 0.185, 0.155), 0.25)
    buried = smoothstep(-0.5, 0.5, spectral(rng, SIZE, 5, 60, 0.7) + 1.2 * (0.55 - dome))
    dust = np.exp(0.10 * spectral(rng, SIZE, 3, 20, 1.0))
    height = 0.025 * dome * (1 - buried) + 0.005 * grit
    return Texture(4.0, mix(coarse, fine, buried) * dust[..., None], height)


def forest_floor(rng: np.random.Generator) -> Texture:
    """Leaf litter with moss and some green."""
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
    greens = np.array([[0.06, 0.085, 0.03], [0.075, 0.10, 0.035]])
    palette = np.concatenate([browns, browns, browns, greens])
    colour = palette[rng.integers(len(palette), size=count)] * np.exp(
        rng.normal(0, 0.25, (count, 1))
    )
    depth = np.maximum(owner, 0) / count
    litter = colour[np.maximum(owner, 0)] * (0.45 + 0.55 * depth + 0.1 * along)[..., None]
    soil = tint((0.05, 0.038, 0.025), np.exp(0.3 * spectral(rng, SIZE, 20, 200, 0.5)))
    moss = smoothstep(0.6, 1.6, spectral(rng, SIZE, 4, 40, 1.0))
    albedo = mix(soil, litter, (owner >= 0).astype(float))
    green = tint((0.055, 0.08, 0.022), np.exp(0.3 * spectral(rng, SIZE, 30, 220, 0.3)))
    return Texture(2.5, mix(albedo, green, 0.6 * moss), 0.02 * depth)


def marking(rng: np.random.Generator, base: tuple[float, float, float]) -> Texture:
    """Road paint, worn off at the tips of the stones."""
    ground = asphalt(rng)
    chips = spectral(rng, FINE, 50, 400, 0.3) + 0.9 * spectral(rng, FINE, 4, 40, 1.0)
    worn = smoothstep(1.5, 2.6, chips)
    dirt = np.exp(0.06 * spectral(rng, FINE, 4, 120, 0.8))
    albedo = mix(tint(base, dirt), ground.albedo, worn)
    return Texture(4.0, albedo, np.asarray(ground.height) * 0.6)


def marking_white(rng: np.random.Generator) -> Texture:
    """White road paint."""
    return marking(rng, (0.58, 0.58, 0.56))


def marking_yellow(rng: np.random.Generator) -> Texture:
    """Yellow road paint (near FHWA yellow)."""
    return marking(rng, (0.55, 0.34, 0.035))
