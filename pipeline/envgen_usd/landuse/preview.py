"""Pictures of landuse."""

from collections.abc import Mapping

import numpy as np
from PIL import Image

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.models.arrays import ByteArray
from envgen_usd.models.landuse import LanduseClass, LanduseMap

COLOURS: Mapping[LanduseClass, tuple[int, int, int]] = {
    LanduseClass.UNKNOWN: (0, 0, 0),
    LanduseClass.ROAD: (70, 70, 75),
    LanduseClass.GRASS: (126, 170, 92),
    LanduseClass.VERGE: (160, 190, 110),
    LanduseClass.LAWN: (190, 225, 130),
    LanduseClass.RUBBLE: (190, 175, 155),
    LanduseClass.ACCESS: (215, 205, 200),
    LanduseClass.WOOD: (50, 110, 60),
}
"""RGB of each class, in pictures and in the colour table of files."""
EDGE = 0.72
"""Brightness of a cell at the edge of its plot."""


def draw_landuse(maps: Mapping[Chunk, LanduseMap]) -> Image.Image:
    """Draws chunks in plan, north up, one pixel a cell, with the borders of plots.

    Args:
        maps: At least one chunk; gaps between chunks are black.
    """
    x = [chunk.x for chunk in maps]
    y = [chunk.y for chunk in maps]
    rows, columns = max(y) - min(y) + 1, max(x) - min(x) + 1
    classes = np.zeros((rows * LANDUSE_CELLS, columns * LANDUSE_CELLS), dtype=np.uint8)
    plots = np.zeros(classes.shape, dtype=np.int64)
    for chunk, made in maps.items():
        row, column = (chunk.y - min(y)) * LANDUSE_CELLS, (chunk.x - min(x)) * LANDUSE_CELLS
        window = np.s_[row : row + LANDUSE_CELLS, column : column + LANDUSE_CELLS]
        classes[window], plots[window] = made.classes, made.plots
    return Image.fromarray(_shade(classes, plots)[::-1])


def _shade(classes: ByteArray, plots: np.ndarray) -> ByteArray:
    palette = np.array([COLOURS[kind] for kind in LanduseClass], dtype=np.float64)
    colours = palette[classes]
    edge = np.zeros(classes.shape, dtype=np.bool_)
    edge[:, 1:] |= plots[:, 1:] != plots[:, :-1]
    edge[1:] |= plots[1:] != plots[:-1]
    colours[edge & (classes != LanduseClass.ACCESS)] *= EDGE
    shaded: ByteArray = colours.astype(np.uint8)
    return shaded
