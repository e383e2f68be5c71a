"""Ground heights of a chunk, and its ground mesh."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.frozen_model import Model

Heights = Callable[[FloatArray], FloatArray]
"""Heights (N, metres) at positions (N x 2, metres, road frame)."""


@dataclass(frozen=True, repr=False, eq=False)
class Water(Model):
    """Water of a chunk.

    Attributes:
        levels: 256 x 256, level of the water at the grid's corners in it and near it, metres; NaN
            elsewhere.
        beyond: 4 x 255, which cells across the chunk's border are water: those in the south and in
            the north from west to east, those in the west and in the east from south to north.
        known: 4, whether the map has a chunk in the south, north, west and east.
    """

    levels: FloatArray
    beyond: BoolArray
    known: BoolArray


@dataclass(frozen=True, repr=False, eq=False)
class HeightMap(Model):
    """Ground height of a chunk.

    Attributes:
        chunk: The tile.
        heights: 256 x 256, metres, road frame. Row j, column i lies at
            ``(chunk.corner_axes()[0][i], chunk.corner_axes()[1][j])``; row 0 is the south edge.
            Corners between land and water have the height of the land.
        water: Its water; `None` without any in or beside the chunk.
    """

    chunk: Chunk
    heights: FloatArray
    water: Water | None = None


@dataclass(frozen=True, repr=False, eq=False)
class GroundMesh(Model):
    """Ground of a chunk: blocks of grid cells, and triangles stitched to the road's outline.

    Where land ends above water, vertical walls join both.

    Attributes:
        chunk: The tile.
        vertices: V x 3, metres, road frame, on `chunks.GRID`.
        face_sizes: F, vertices of each face (3 or 4).
        face_vertices: sum(face_sizes), counter-clockwise seen from above.
        face_cell: F, landuse cell (row * 255 + column) at the face's centre. Where that cell's
            centre is on the road, the nearest cell off the road. That of a wall is the water's.
        walls: Number of the last faces that are walls.
    """

    chunk: Chunk
    vertices: FloatArray
    face_sizes: IntArray
    face_vertices: IntArray
    face_cell: IntArray
    walls: int = 0

    @property
    def is_wall(self) -> BoolArray:
        """F, True for walls."""
        return np.arange(len(self.face_sizes)) >= len(self.face_sizes) - self.walls
