"""Ground truth of heights: drawn roads laid into land, as seen from the road alone."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS
from envgen_usd.geometry.outline import Outline
from envgen_usd.landuse.network.height_land import Land, draw_land
from envgen_usd.landuse.network.height_sample import HeightSample
from envgen_usd.landuse.network.layouts import AREA, KINDS, draw_layout
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface
from envgen_usd.seeds import generator

Terrain: TypeAlias = Callable[[RoadSurface, TerrainRules, Heights | None], Heights]
"""Ground around a road: laid into a land with banks, or, without one, what the road alone tells.

It belongs to another layer, so it is handed in.
"""
HeightSplit = Literal["train", "unseen"]
HEIGHT_CONDITIONS = 3
"""Numbers that `describe_terrain` returns."""
FAR = 1000.0
"""Metres to the road from which on it does not matter how far it is."""


@dataclass(frozen=True)
class HeightScene:
    """Where a sample comes from.

    Attributes:
        surface: Roads, draped over the land.
        land: The land without them.
        kind: Layout.
    """

    surface: RoadSurface
    land: Land
    kind: str


def describe_terrain(rules: TerrainRules) -> NDArray[np.float32]:
    """Numbers of the order of one that describe relief and banks."""
    figures = (rules.relief - 0.75, np.log(rules.relief_wavelength / 100.0), rules.bank_slope - 0.5)
    return np.array(figures, dtype=np.float32)


def make_height_scene(split: HeightSplit, number: int, seed: int) -> HeightScene:
    """Draws land and roads of one sample; splits share neither."""
    rng = generator(seed, "heights", "sample", split, number)
    return drape_layout(draw_land(rng), rng)


def drape_layout(land: Land, rng: np.random.Generator) -> HeightScene:
    """Draws roads over a land, whose middle is that of a layout's square."""
    kind = KINDS[rng.integers(len(KINDS))]
    return HeightScene(draw_layout(kind, rng, land.followed), land, kind)


def make_height_sample(
    scene: HeightScene, terrain: Terrain, side: int = 2 * LANDUSE_CELLS
) -> HeightSample:
    """Makes one sample.

    Args:
        scene: Land and roads.
        terrain: What lays the ground.
        side: Cells along a side of the square around the layout's middle; even.
    """
    rules = scene.land.rules
    steps = np.arange(side, dtype=np.float64) + 0.5 - side / 2
    centres = AREA / 2 + steps * CELL_SIZE
    reference = on_grid(terrain(scene.surface, rules, None), centres, centres)
    truth = on_grid(terrain(scene.surface, rules, scene.land.bare), centres, centres)
    outline = Outline.of(scene.surface)
    road = outline.encloses_grid(centres, centres)
    rise = np.where(road, 0.0, truth - reference)
    raw = height_raw(outline, reference, centres, centres)
    maps = reference.astype(np.float32), rise.astype(np.float32)
    return HeightSample(raw, describe_terrain(rules), *maps, road)


def height_raw(
    outline: Outline, reference: FloatArray, x: FloatArray, y: FloatArray
) -> NDArray[np.float16]:
    """Stored fields of a window.

    Args:
        outline: Where road and ground meet.
        reference: H x W, metres.
        x: W, metres, middles of cells.
        y: H, metres.

    Returns:
        `HEIGHT_RAW` x H / 2 x W / 2.
    """
    middles = [(axis[::2] + axis[1::2]) / 2 for axis in (x, y)]
    places = np.stack(np.meshgrid(*middles), axis=-1).reshape(-1, 2)
    distance, foot = outline.nearest(places)
    distance = np.minimum(distance, FAR)
    away = (places - foot[:, :2]).T / np.maximum(distance, 1e-6)
    ground = reference.reshape(len(y) // 2, 2, len(x) // 2, 2).mean(axis=(1, 3)).ravel()
    stacked = np.stack([distance, *np.clip(away, -1.0, 1.0), foot[:, 2] - ground])
    raw: NDArray[np.float16] = stacked.astype(np.float16)
    return raw.reshape(-1, len(y) // 2, len(x) // 2)


def on_grid(heights: Heights, x: FloatArray, y: FloatArray) -> FloatArray:
    """Heights at the places of a grid, len(y) x len(x)."""
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return heights(places).reshape(len(y), len(x))
