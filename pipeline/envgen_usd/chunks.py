"""The 200 m × 200 m tiles into which every map is cut."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.arrays import FloatArray

CHUNK_SIZE = 200.0
"""Side of a chunk in metres."""
HEIGHT_SAMPLES = 256
"""Corners of the height grid along each side of a chunk; neighbours share their border."""
LANDUSE_CELLS = 255
"""Cells of the landuse grid along each side; cell (row, column) lies between four corners."""
CELL_SIZE = CHUNK_SIZE / LANDUSE_CELLS
"""Side of a landuse cell in metres."""
GRID = 1e-3
"""Coordinates of surfaces lie on this grid (metres), so that equal places are equal numbers."""

CITY_FILE = "city.gml"
"""Name of the CityGML file in a chunk's folder."""


def snap(values: FloatArray) -> FloatArray:
    """Rounds coordinates to `GRID`; equal places become equal numbers."""
    snapped: FloatArray = np.round(values / GRID) / round(1 / GRID)
    return snapped


@dataclass(frozen=True, order=True)
class Chunk:
    """A tile by its integer place; its lower left corner is at (200 x, 200 y) m, road frame."""

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
        """Coordinates of the grid's corners on the `GRID`: x of shape (256,), y of shape (256,)."""
        steps: FloatArray = np.arange(HEIGHT_SAMPLES, dtype=np.float64) * CELL_SIZE
        x, y = self.origin
        return snap(x + steps), snap(y + steps)

    def cell_centres(self) -> tuple[FloatArray, FloatArray]:
        """Centres of the landuse cells: x of shape (255,), y of shape (255,), metres."""
        steps: FloatArray = (np.arange(LANDUSE_CELLS, dtype=np.float64) + 0.5) * CELL_SIZE
        x, y = self.origin
        return x + steps, y + steps

    def neighbours(self) -> Iterator["Chunk"]:
        """The eight chunks around this one."""
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                if dx or dy:
                    yield Chunk(self.x + dx, self.y + dy)


def chunks_of_points(points: FloatArray, margin: float = 0.0) -> tuple[Chunk, ...]:
    """Returns the chunks that hold points, or lie within a margin of one, sorted.

    Args:
        points: N x 2 or N x 3, metres, road frame.
        margin: Distance in metres around each point; at most `CHUNK_SIZE`.
    """
    found: set[tuple[int, int]] = set()
    for dx in (-margin, 0.0, margin):
        for dy in (-margin, 0.0, margin):
            index = np.floor((points[:, :2] + (dx, dy)) / CHUNK_SIZE).astype(np.int64)
            found.update(map(tuple, np.unique(index, axis=0).tolist()))
    return tuple(sorted(Chunk(x, y) for x, y in found))
