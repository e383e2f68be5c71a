"""Windows: a chunk with the edges of its neighbours, on the map's lattice of cells."""

from collections.abc import Callable, Mapping

import numpy as np

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.models.arrays import ByteArray, FloatArray

HALO = 32
"""Cells of the neighbours that a window shows to the west and to the south."""
SIDE = 320
"""Cells along a side of a window; one more cell of the neighbours lies to the east and north."""


def lattice(chunk: Chunk, step: int) -> tuple[FloatArray, FloatArray]:
    """Middles (x, y; metres) of blocks of step x step cells of a chunk's window."""
    offsets = (np.arange(SIDE // step, dtype=np.float64) * step + step / 2 - HALO) * CELL_SIZE
    x, y = chunk.origin
    return x + offsets, y + offsets


def gather(chunk: Chunk, read: Callable[[Chunk], np.ndarray]) -> np.ndarray:
    """Puts arrays (... x 255 x 255) of a chunk and its neighbours together: ... x `SIDE`²."""
    rows = [
        np.concatenate([read(Chunk(chunk.x + dx, chunk.y + dy)) for dx in (-1, 0, 1)], axis=-1)
        for dy in (-1, 0, 1)
    ]
    cut = slice(LANDUSE_CELLS - HALO, LANDUSE_CELLS - HALO + SIDE)
    return np.concatenate(rows, axis=-2)[..., cut, cut]


def inner(window: np.ndarray) -> np.ndarray:
    """The chunk's own cells of a window (... x `SIDE`²)."""
    cut = slice(HALO, HALO + LANDUSE_CELLS)
    return window[..., cut, cut]


def mosaic(maps: Mapping[Chunk, ByteArray], empty: int) -> tuple[ByteArray, Chunk]:
    """Joins chunks to one raster; also returns the chunk at its lower left."""
    first = Chunk(min(c.x for c in maps), min(c.y for c in maps))
    width, height = (max(getattr(c, a) - getattr(first, a) for c in maps) + 1 for a in "xy")
    joined = np.full((height * LANDUSE_CELLS, width * LANDUSE_CELLS), empty, dtype=np.uint8)
    for chunk, cells in maps.items():
        tile(joined, chunk, first)[...] = cells
    return joined, first


def tile(joined: np.ndarray, chunk: Chunk, first: Chunk) -> np.ndarray:
    """View of one chunk in a mosaic."""
    row, column = (chunk.y - first.y) * LANDUSE_CELLS, (chunk.x - first.x) * LANDUSE_CELLS
    return joined[row : row + LANDUSE_CELLS, column : column + LANDUSE_CELLS]
