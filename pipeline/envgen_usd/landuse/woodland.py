"""Woods beside roads and plots."""

import math
from collections.abc import Collection
from statistics import NormalDist

import numpy as np
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.geometry.smooth_noise import smooth_noise_grid
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.seeds import generator

WAVELENGTH = 70.0
"""Size of wood patches, metres; a larger value gives larger woods."""
EDGE = (0.96, 0.28)
"""Weights of the patches and of waves of a quarter of the length, for irregular edges.

Their squares add up to 1, so that the sum keeps unit variance.
"""
DISTANCE = 5.0
"""Distance between wood and roads, metres; a larger value widens clearings."""
BRUSH = np.hypot(*np.mgrid[-2:3, -2:3]) < 2.5
"""Structuring element of the smallest patch, about 4 m across.

A larger element removes more specks and slivers.
"""
AROUND = len(BRUSH) - 1
"""Width of the margin that affects a chunk's cells, cells."""
_BLOCKS = (25, 5)
"""Cells along a side of the blocks whose distance from the road is looked at as one, in turn."""
_ROUNDING = 1e-6
"""Room for rounding where distances are compared, metres."""


def draw_wood(
    chunk: Chunk, away: FloatArray, taken: shapely.STRtree, share: float, seed: int
) -> BoolArray:
    """Cells covered by wood, 255 x 255.

    Args:
        chunk: Tile.
        away: Distances from the road with a margin of `AROUND` cells (`road_distance`), of which
            `DISTANCE` is a limit.
        taken: Shapes without wood.
        share: Share of wood on the free land, 0 to 1.
        seed: The user's seed.
    """
    low, high = np.array(chunk.bounds).reshape(2, 2) + np.array([[-1], [1]]) * AROUND * CELL_SIZE
    shapes = taken.geometries[taken.query(shapely.box(*low, *high))]
    free = cells_of_shapes(chunk, ((shape, 1) for shape in shapes), AROUND) == 0
    free &= away > DISTANCE
    opened = ndimage.binary_opening(free & (_noise(chunk, seed) > wood_level(share)), BRUSH)
    wood: BoolArray = opened[AROUND:-AROUND, AROUND:-AROUND]
    return wood


def road_distance(chunk: Chunk, outline: Outline, limits: Collection[float]) -> FloatArray:
    """Distance of the centres of cells from the outline, exact where a limit may be crossed.

    Land changes at a few distances. So a cell takes the distance of the middle of its block,
    unless one of the limits is as near to it as the cell is to that middle; then it takes that of
    a smaller block, and at last its own.

    Args:
        chunk: Tile.
        outline: Outline of the road.
        limits: Distances that decide about the land, metres.

    Returns:
        (255 + 2 `AROUND`)², the cells of the chunk and of a margin around it; metres, on the same
        side of each limit as the exact distance.
    """
    x, y = _axes(chunk)
    farthest = max(limits)
    near = outline.near(chunk.bounds, farthest + AROUND * CELL_SIZE + _reach(_BLOCKS[0]))
    distance = np.full((len(y), len(x)), np.inf)
    open_ = np.ones(distance.shape, dtype=np.bool_)
    for size in _BLOCKS:
        starts = np.arange(0, len(x), size)
        middles = np.minimum(starts + size // 2, len(x) - 1)
        some = np.logical_or.reduceat(np.logical_or.reduceat(open_, starts, 0), starts, 1)
        row, column = np.nonzero(some)
        places = np.stack([x[middles[column]], y[middles[row]]], axis=1)
        coarse = np.full(some.shape, np.inf)
        coarse[row, column] = near.nearest(places, farthest + _reach(size))[0]
        gap = np.min([np.abs(coarse - limit) for limit in limits], axis=0)
        blocks = np.arange(len(x)) // size
        of_cells = np.ix_(blocks, blocks)
        np.copyto(distance, coarse[of_cells], where=open_)
        aside_x, aside_y = (along - along[middles][blocks] for along in (x, y))
        open_ &= gap[of_cells] <= np.hypot(aside_x, aside_y[:, None]) + _ROUNDING
    row, column = np.nonzero(open_)
    cells = np.stack([x[column], y[row]], axis=1)
    distance[row, column] = near.nearest(cells, farthest)[0]
    return distance


def _reach(size: int) -> float:
    """Largest distance of a block's cell from its middle cell, metres, with room for rounding."""
    return math.sqrt(2.0) * (size // 2) * CELL_SIZE + _ROUNDING


def wood_noise(x: FloatArray, y: FloatArray, seed: int) -> FloatArray:
    """Noise of unit variance on a grid (x: W, y: H, metres), H x W; high values are wood."""
    draw = generator(seed, "landuse", "wood")
    patches = EDGE[0] * smooth_noise_grid(x, y, WAVELENGTH, draw)
    return patches + EDGE[1] * smooth_noise_grid(x, y, WAVELENGTH / 4, draw)


def wood_level(share: float) -> float:
    """The value that the noise exceeds on a share of the land, where share > 0."""
    return NormalDist().inv_cdf(1 - share) if share < 1.0 else -math.inf


def _noise(chunk: Chunk, seed: int) -> FloatArray:
    return wood_noise(*_axes(chunk), seed)


def _axes(chunk: Chunk) -> tuple[FloatArray, FloatArray]:
    """Centres of the cells of a chunk and of the margin around it: x, y, metres."""
    margin = np.arange(1, AROUND + 1) * CELL_SIZE
    x, y = (
        np.concatenate([along[0] - margin[::-1], along, along[-1] + margin])
        for along in chunk.cell_centres()
    )
    return x, y
