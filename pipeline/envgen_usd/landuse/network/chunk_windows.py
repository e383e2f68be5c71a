"""Windows: a chunk with a margin of its neighbours, on the map's lattice of cells."""

from collections.abc import Callable, Mapping

import numpy as np

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import ByteArray, FloatArray

HALO = 32
"""Margin of the neighbours to the west and to the south, cells; a larger value adds context."""
SIDE = 320
"""Side length of a window, cells; the margin to the east and north is one cell wider."""


def lattice(chunk: Chunk, step: int) -> tuple[FloatArray, FloatArray]:
    """Centres (x, y; metres) of blocks of step x step cells of a chunk's window."""
    offsets = (np.arange(SIDE // step, dtype=np.float64) * step + step / 2 - HALO) * CELL_SIZE
    x, y = chunk.origin
    return x + offsets, y + offsets


def gather(chunk: Chunk, read: Callable[[Chunk], np.ndarray]) -> np.ndarray:
    """Joins arrays (... x 255 x 255) of a chunk and its neighbours: ... x `SIDE`²."""
    rows = [
        np.concatenate([read(Chunk(chunk.x + dx, chunk.y + dy)) for dx in (-1, 0, 1)], axis=-1)
        for dy in (-1, 0, 1)
    ]
    cut = slice(LANDUSE_CELLS - HALO, LANDUSE_CELLS - HALO + SIDE)
    return np.concatenate(rows, axis=-2)[..., cut, cut]


def inner(window: np.ndarray) -> np.ndarray:
    """The cells of the chunk within a window (... x `SIDE`²)."""
    cut = slice(HALO, HALO + LANDUSE_CELLS)
    return window[..., cut, cut]


def mosaic(maps: Mapping[Chunk, ByteArray], empty: int) -> tuple[ByteArray, Chunk]:
    """Joins chunks to a raster; also returns the chunk at its lower left."""
    first = Chunk(min(c.x for c in maps), min(c.y for c in maps))
    width, height = (max(getattr(c, a) - getattr(first, a) for c in maps) + 1 for a in "xy")
    joined = np.full((height * LANDUSE_CELLS, width * LANDUSE_CELLS), empty, dtype=np.uint8)
    for chunk, cells in maps.items():
        tile(joined, chunk, first)[...] = cells
    return joined, first


def tile(joined: np.ndarray, chunk: Chunk, first: Chunk) -> np.ndarray:
    """View of a chunk in a mosaic."""
    row, column = (chunk.y - first.y) * LANDUSE_CELLS, (chunk.x - first.x) * LANDUSE_CELLS
    return joined[row : row + LANDUSE_CELLS, column : column + LANDUSE_CELLS]
