"""Woods beside roads and plots."""

import math
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


def draw_wood(
    chunk: Chunk, away: FloatArray, taken: shapely.STRtree, share: float, seed: int
) -> BoolArray:
    """Cells covered by wood, 255 x 255.

    Args:
        chunk: Tile.
        away: Distances from the road with a margin of `AROUND` cells (`road_distance`).
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


def road_distance(chunk: Chunk, outline: Outline, within: float) -> FloatArray:
    """Distance of the centres of cells from the outline, metres; infinite beyond a distance.

    Args:
        chunk: Tile.
        outline: Outline of the road.
        within: Largest distance, metres; a smaller value is faster.

    Returns:
        (255 + 2 `AROUND`)², the cells of the chunk and of a margin around it.
    """
    x, y = _axes(chunk)
    cells = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    near = outline.near(chunk.bounds, within + AROUND * CELL_SIZE)
    distance: FloatArray = near.nearest(cells, within)[0].reshape(len(y), len(x))
    return distance


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
