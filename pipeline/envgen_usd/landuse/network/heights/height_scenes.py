"""Ground truth of heights: random roads laid over land, and the ground that they tell of."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.height_sample import (
    HEIGHT_CELL,
    HeightSample,
)
from envgen_usd.landuse.network.data.road_layouts import AREA, KINDS, draw_layout
from envgen_usd.landuse.network.heights.drawn_land import Land, draw_land
from envgen_usd.landuse.network.heights.road_membrane import ground_of_roads
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

HeightSplit = Literal["train", "unseen"]
SQUARE = 64
"""Side of a sample's square, cells of heights: 800 m, twice that of a layout."""
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


@dataclass(frozen=True)
class RoadCells:
    """Roads beside cells of heights.

    Attributes:
        fields: 4 x H x W: distance to the nearest road, metres; unit vector away from it; its
            height, metres.
        road: H x W, cells that roads touch.
    """

    fields: FloatArray
    road: BoolArray

    def part(self, rows: slice, columns: slice) -> "RoadCells":
        """A window."""
        return RoadCells(self.fields[:, rows, columns], self.road[rows, columns])


@dataclass(frozen=True)
class RoadGround:
    """What roads tell of the ground around them, on cells of heights.

    Attributes:
        raw: `HEIGHT_RAW` x H / 2 x W / 2.
        condition: 1.
        reference: H x W, metres: the ground interpolated from the roads.
        road: H x W, cells that roads touch.
    """

    raw: NDArray[np.float16]
    condition: NDArray[np.float32]
    reference: FloatArray
    road: BoolArray


def make_height_scene(split: HeightSplit, number: int, seed: int) -> HeightScene:
    """Draws land and roads of a sample; splits share neither."""
    rng = generator(seed, "heights", "sample", split, number)
    return drape_layout(draw_land(rng), rng)


def drape_layout(land: Land, rng: np.random.Generator) -> HeightScene:
    """Drapes random roads over land; its centre is that of a layout's square."""
    kind = KINDS[rng.integers(len(KINDS))]
    return HeightScene(draw_layout(kind, rng, land.followed), land, kind)


def make_height_sample(scene: HeightScene) -> HeightSample:
    """Generates the sample of a scene: `SQUARE` cells around the layout's centre."""
    centres = square_centres()
    told = ground_beside(road_cells(scene.surface, centres, centres))
    # Banks are laid afterwards, as around a road in an elevation model.
    truth = on_grid(scene.land.bare, centres, centres)
    rise = np.where(told.road, 0.0, truth - told.reference)
    maps = told.reference.astype(np.float32), rise.astype(np.float32)
    return HeightSample(told.raw, told.condition, *maps, told.road)


def square_centres() -> FloatArray:
    """Centres of a sample's cells along either axis of a layout, metres."""
    steps = np.arange(SQUARE, dtype=np.float64) + 0.5 - SQUARE / 2.0
    centres: FloatArray = AREA / 2.0 + steps * HEIGHT_CELL
    return centres


def road_cells(surface: RoadSurface, x: FloatArray, y: FloatArray) -> RoadCells:
    """The roads beside the cells of a grid.

    Args:
        surface: Roads.
        x: W, cell centres, metres; an even number.
        y: H, cell centres, metres; an even number.
    """
    outline = Outline.of(surface)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    distance, foot = outline.nearest(places)
    away = (places - foot[:, :2]).T / np.maximum(distance, 1e-6)
    size = len(y), len(x)
    near = distance.reshape(size) <= HEIGHT_CELL / 2.0
    fields = np.stack([np.minimum(distance, FAR), *away, foot[:, 2]])
    return RoadCells(fields.reshape(-1, *size), near | outline.encloses_grid(x, y))


def ground_beside(roads: RoadCells) -> RoadGround:
    """What roads tell of the ground of a window."""
    heights, road = roads.fields[-1], roads.road
    reference = ground_of_roads(heights, road)
    fields = np.stack([*roads.fields[:-1], heights - reference])
    rows, columns = road.shape
    raw = fields.reshape(len(fields), rows // 2, 2, columns // 2, 2).mean(axis=(2, 4))
    return RoadGround(raw.astype(np.float16), describe_roads(heights[road]), reference, road)


def describe_roads(heights: FloatArray) -> NDArray[np.float32]:
    """A number of order one that tells how much the heights of roads differ, N, metres."""
    spread = float(np.std(heights)) if len(heights) else 0.0
    return np.array([np.log1p(spread / 5.0)], dtype=np.float32)


def on_grid(heights: Heights, x: FloatArray, y: FloatArray) -> FloatArray:
    """Heights at the points of a grid, len(y) x len(x), metres."""
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return heights(places).reshape(len(y), len(x))
