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
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
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
_BLOCK = 5
"""Cells along a side of a block whose distance from the road is looked at as one."""
_ROUNDING = 1e-6
"""Room for rounding where distances are compared, metres."""
_REACH = math.sqrt(2.0) * (_BLOCK // 2) * CELL_SIZE + _ROUNDING
"""Largest distance of a block's cell from its middle cell, metres, with room for rounding."""


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
    unless one of the limits is as near to it as the cell is to the middle of its block.

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
    near = outline.near(chunk.bounds, farthest + AROUND * CELL_SIZE + _REACH)
    middles, blocks = _blocks(len(x))
    places = np.stack(np.meshgrid(x[middles], y[middles]), axis=-1).reshape(-1, 2)
    coarse = near.nearest(places, farthest + _REACH)[0].reshape(len(middles), len(middles))
    gap = np.min([np.abs(coarse - limit) for limit in limits], axis=0)
    aside = x - x[middles][blocks], y - y[middles][blocks]
    moved = np.hypot(aside[0], aside[1][:, None]) + _ROUNDING
    distance: FloatArray = coarse[np.ix_(blocks, blocks)]
    row, column = np.nonzero(gap[np.ix_(blocks, blocks)] <= moved)
    cells = np.stack([x[column], y[row]], axis=1)
    distance[row, column] = near.nearest(cells, farthest)[0]
    return distance


def _blocks(count: int) -> tuple[IntArray, IntArray]:
    """Middle cell of each block along an axis, and the block of each of the axis' cells."""
    blocks = np.arange(count) // _BLOCK
    middles = np.minimum(np.arange(blocks[-1] + 1) * _BLOCK + _BLOCK // 2, count - 1)
    return middles, blocks


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
