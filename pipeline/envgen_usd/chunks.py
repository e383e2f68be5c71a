"""Square tiles of 200 m x 200 m that partition a map."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_fill_holes

from envgen_usd.models.array_types import FloatArray, IntArray

CHUNK_SIZE = 200.0
"""Side length of a chunk, metres."""
HEIGHT_SAMPLES = 256
"""Height samples along each side of a chunk; neighbouring chunks share their border samples."""
LANDUSE_CELLS = 255
"""Landuse cells along each side of a chunk; each cell lies between four height samples."""
CELL_SIZE = CHUNK_SIZE / LANDUSE_CELLS
"""Side length of a landuse cell, metres."""
GRID = 1e-3
"""Grid spacing of surface coordinates, metres; coincident vertices have equal coordinates."""

_PRIM_NAME = re.compile(r"chunk_m?\d+_m?\d+")
_ROW = 2**32
"""Number of indices along y; points beyond would be 430 million kilometres away."""

CITY_FILE = "city.gml"
"""Name of the CityGML file in a chunk's folder."""


def is_chunk_name(name: str) -> bool:
    """True for the name of a chunk's prim."""
    return bool(_PRIM_NAME.fullmatch(name))


def snap(values: FloatArray) -> FloatArray:
    """Rounds coordinates to `GRID`, so that coincident points have equal coordinates."""
    snapped: FloatArray = np.round(values / GRID) / round(1 / GRID)
    return snapped


@dataclass(frozen=True, order=True)
class Chunk:
    """A tile by its indices (x, y); its lower left corner is at (200 x, 200 y) m, road frame."""

    x: int
    y: int

    @property
    def name(self) -> str:
        """Folder name, e.g. ``-1_2``."""
        return f"{self.x}_{self.y}"

    @property
    def prim_name(self) -> str:
        """Name of the chunk's prim, e.g. ``chunk_m1_2`` (a prim's name has no minus sign)."""
        return f"chunk_{self.x}_{self.y}".replace("-", "m")

    @property
    def origin(self) -> tuple[float, float]:
        """Lower left corner (x, y) in metres, road frame."""
        return self.x * CHUNK_SIZE, self.y * CHUNK_SIZE

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """(min x, min y, max x, max y) in metres, road frame."""
        x, y = self.origin
        return x, y, x + CHUNK_SIZE, y + CHUNK_SIZE

    def corner_axes(self) -> tuple[FloatArray, FloatArray]:
        """Height sample coordinates on `GRID`: x of shape (256,), y of shape (256,), metres."""
        steps: FloatArray = np.arange(HEIGHT_SAMPLES, dtype=np.float64) * CELL_SIZE
        x, y = self.origin
        return snap(x + steps), snap(y + steps)

    def cell_centres(self) -> tuple[FloatArray, FloatArray]:
        """Centres of the landuse cells: x of shape (255,), y of shape (255,), metres."""
        steps: FloatArray = (np.arange(LANDUSE_CELLS, dtype=np.float64) + 0.5) * CELL_SIZE
        x, y = self.origin
        return x + steps, y + steps

    def neighbours(self) -> Iterator["Chunk"]:
        """The eight neighbouring chunks."""
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                if dx or dy:
                    yield Chunk(self.x + dx, self.y + dy)


def tiles_of(points: FloatArray) -> IntArray:
    """Returns the indices (x, y) of the chunks that contain points, N x 2.

    A point on the border of two chunks belongs to the eastern or northern chunk.

    Args:
        points: N x 2 or N x 3, metres, road frame.
    """
    tiles: IntArray = np.floor(points[:, :2] / CHUNK_SIZE).astype(np.int64)
    return tiles


def chunk_at(point: FloatArray) -> Chunk:
    """Returns the chunk that contains a point (2 or 3), as `tiles_of` does."""
    x, y = tiles_of(point[None])[0].tolist()
    return Chunk(x, y)


def chunks_of_points(points: FloatArray, margin: float = 0.0) -> tuple[Chunk, ...]:
    """Returns the chunks within a margin of any point, sorted.

    Args:
        points: N x 2 or N x 3, metres, road frame.
        margin: Distance around each point, metres; at most `CHUNK_SIZE`.
    """
    offsets = [(dx, dy) for dx in (-margin, 0.0, margin) for dy in (-margin, 0.0, margin)]
    tiles = (tiles_of(points[:, :2] + offset).T for offset in offsets)
    # Rows as single numbers: these are sorted ten times as fast.
    numbers = np.unique(np.concatenate([np.unique(x * _ROW + y) for x, y in tiles]))
    y = (numbers + _ROW // 2) % _ROW - _ROW // 2
    indices = np.stack([(numbers - y) // _ROW, y], axis=1)
    return tuple(Chunk(*index) for index in indices.tolist())


def without_holes(chunks: Iterable[Chunk]) -> tuple[Chunk, ...]:
    """Chunks with those that they enclose on all sides, sorted."""
    places = np.array([(chunk.x, chunk.y) for chunk in chunks])
    low = places.min(axis=0)
    taken = np.zeros(np.ptp(places, axis=0) + 1, bool)
    taken[tuple((places - low).T)] = True
    filled = np.argwhere(binary_fill_holes(taken)) + low
    return tuple(sorted(Chunk(x, y) for x, y in filled.tolist()))
