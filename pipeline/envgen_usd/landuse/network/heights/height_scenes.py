"""Ground truth of heights: random roads laid into land, and the reference from the road alone."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HeightSample
from envgen_usd.landuse.network.data.road_layouts import AREA, KINDS, draw_layout
from envgen_usd.landuse.network.heights.drawn_land import Land, draw_land
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

Terrain: TypeAlias = Callable[[RoadSurface, TerrainRules, Heights | None], Heights]
"""Ground around a road: laid into land with banks, or, without land, interpolated from the road.

It belongs to another layer, so callers pass it in.
"""
HeightSplit = Literal["train", "unseen"]
HEIGHT_CONDITIONS = 3
"""Length of `describe_terrain`'s result."""
SQUARE = round(AREA / HEIGHT_CELL)
"""Side of a layout's square, cells of heights."""
FAR = 1000.0
"""Distance to the road above which the exact distance is irrelevant, metres."""


@dataclass(frozen=True)
class HeightScene:
    """Roads and land of a sample.

    Attributes:
        surface: Roads, draped over the land.
        land: Land without roads.
        kind: Kind of layout.
    """

    surface: RoadSurface
    land: Land
    kind: str


def describe_terrain(rules: TerrainRules) -> NDArray[np.float32]:
    """Numbers of order one that describe relief and banks."""
    figures = (rules.relief - 0.75, np.log(rules.relief_wavelength / 100.0), rules.bank_slope - 0.5)
    return np.array(figures, dtype=np.float32)


def make_height_scene(split: HeightSplit, number: int, seed: int) -> HeightScene:
    """Draws land and roads of a sample; splits share neither."""
    rng = generator(seed, "heights", "sample", split, number)
    return drape_layout(draw_land(rng), rng)


def drape_layout(land: Land, rng: np.random.Generator) -> HeightScene:
    """Drapes random roads over land; its centre is that of a layout's square."""
    kind = KINDS[rng.integers(len(KINDS))]
    return HeightScene(draw_layout(kind, rng, land.followed), land, kind)


def make_height_sample(
    scene: HeightScene, terrain: Terrain, side: int = SQUARE, cell: float = HEIGHT_CELL
) -> HeightSample:
    """Generates a sample.

    Args:
        scene: Land and roads.
        terrain: Interpolates the ground from the road.
        side: Side length of the square around the layout's centre, cells; even.
        cell: Side of a cell, metres.
    """
    rules = scene.land.rules
    steps = np.arange(side, dtype=np.float64) + 0.5 - side / 2
    centres = AREA / 2 + steps * cell
    reference = on_grid(terrain(scene.surface, rules, None), centres, centres)
    # Banks are laid afterwards, as around a road in an elevation model.
    truth = on_grid(scene.land.bare, centres, centres)
    outline = Outline.of(scene.surface)
    road = road_cells(outline, centres, centres)
    rise = np.where(road, 0.0, truth - reference)
    raw = height_raw(outline, reference, centres, centres)
    maps = reference.astype(np.float32), rise.astype(np.float32)
    return HeightSample(raw, describe_terrain(rules), *maps, road)


def height_raw(
    outline: Outline, reference: FloatArray, x: FloatArray, y: FloatArray
) -> NDArray[np.float16]:
    """Stored fields of a window.

    Args:
        outline: Outline of the road.
        reference: H x W, metres.
        x: W, cell centres, metres.
        y: H, cell centres, metres.

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


def road_cells(outline: Outline, x: FloatArray, y: FloatArray) -> BoolArray:
    """True for cells with road at their centre, or its border within half of their side.

    Args:
        outline: Outline of the road.
        x: W, cell centres, metres.
        y: H, cell centres, metres.
    """
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    distance, _ = outline.nearest(places)
    touched = distance.reshape(len(y), len(x)) <= (x[1] - x[0]) / 2.0
    road: BoolArray = touched | outline.encloses_grid(x, y)
    return road


def on_grid(heights: Heights, x: FloatArray, y: FloatArray) -> FloatArray:
    """Heights at the points of a grid, len(y) x len(x), metres."""
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return heights(places).reshape(len(y), len(x))
