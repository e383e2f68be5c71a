"""Where trees stand densely beside roads and plots."""

from statistics import NormalDist

import numpy as np
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.geometry.noise import smooth_noise_grid
from envgen_usd.geometry.outline import Outline
from envgen_usd.landuse.raster import cells_of_shapes
from envgen_usd.models.arrays import BoolArray, FloatArray
from envgen_usd.seeds import generator

WAVELENGTH = 70.0
"""Metres, size of patches of wood."""
EDGE = (0.96, 0.28)
"""Weights of the patches and of waves a quarter as long, which make their edges irregular; the
squares add up to one, so that the sum has the variance of each."""
DISTANCE = 5.0
"""Metres between wood and roads."""
BRUSH = np.hypot(*np.mgrid[-2:3, -2:3]) < 2.5
"""Smallest patch of wood, about 4 m across: specks and slivers without room for it are no wood."""
AROUND = len(BRUSH) - 1
"""Cells around a chunk on which its own depend."""


def draw_wood(
    chunk: Chunk, outline: Outline, taken: shapely.STRtree, share: float, seed: int
) -> BoolArray:
    """Cells under trees, 255 x 255.

    Args:
        chunk: Tile.
        outline: The road's.
        taken: Shapes that wood keeps out of.
        share: Share of the free land under trees, 0 to 1.
        seed: The user's seed.
    """
    low, high = np.array(chunk.bounds).reshape(2, 2) + np.array([[-1], [1]]) * AROUND * CELL_SIZE
    shapes = taken.geometries[taken.query(shapely.box(*low, *high))]
    free = cells_of_shapes(chunk, ((shape, 1) for shape in shapes), AROUND) == 0
    free &= ~near_road(chunk, outline, DISTANCE, AROUND)
    opened = ndimage.binary_opening(free & (_noise(chunk, seed) > wood_level(share)), BRUSH)
    wood: BoolArray = opened[AROUND:-AROUND, AROUND:-AROUND]
    return wood


def near_road(chunk: Chunk, outline: Outline, distance: float, around: int = 0) -> BoolArray:
    """Cells of a chunk, and of some around it, whose centre is within a distance of the outline.

    Args:
        chunk: Tile.
        outline: The road's.
        distance: Metres.
        around: Cells on every side of the chunk.
    """
    near = outline.near(chunk.bounds, distance + around * CELL_SIZE)
    edges = shapely.linestrings(np.stack([near.start[:, :2], near.end[:, :2]], axis=1))
    close = shapely.buffer(edges, distance, quad_segs=4)
    return cells_of_shapes(chunk, ((shape, 1) for shape in close), around) > 0


def wood_noise(x: FloatArray, y: FloatArray, seed: int) -> FloatArray:
    """Noise of unit variance on a grid (x: W, y: H, metres), H x W; wood is where it is high."""
    draw = generator(seed, "landuse", "wood")
    patches = EDGE[0] * smooth_noise_grid(x, y, WAVELENGTH, draw)
    return patches + EDGE[1] * smooth_noise_grid(x, y, WAVELENGTH / 4, draw)


def wood_level(share: float) -> float:
    """The value that the noise exceeds on a share of the land, which is above 0."""
    return NormalDist().inv_cdf(1 - share)


def _noise(chunk: Chunk, seed: int) -> FloatArray:
    x, y = (
        np.concatenate([along[0] - before[::-1], along, along[-1] + before])
        for before in [np.arange(1, AROUND + 1) * CELL_SIZE]
        for along in chunk.cell_centres()
    )
    return wood_noise(x, y, seed)
