"""Ground heights of a chunk, and its ground mesh."""

from collections.abc import Callable
from dataclasses import dataclass

from envgen_usd.chunks import Chunk
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.frozen_model import Model

Heights = Callable[[FloatArray], FloatArray]
"""Heights (N, metres) at positions (N x 2, metres, road frame)."""


@dataclass(frozen=True, repr=False, eq=False)
class HeightMap(Model):
    """Ground height of a chunk.

    Attributes:
        chunk: The tile.
        heights: 256 x 256, metres, road frame. Row j, column i lies at
            ``(chunk.corner_axes()[0][i], chunk.corner_axes()[1][j])``; row 0 is the south edge.
    """

    chunk: Chunk
    heights: FloatArray


@dataclass(frozen=True, repr=False, eq=False)
class GroundMesh(Model):
    """Ground of a chunk: blocks of grid cells, and triangles stitched to the road's outline.

    Attributes:
        chunk: The tile.
        vertices: V x 3, metres, road frame, on `chunks.GRID`.
        face_sizes: F, vertices of each face (3 or 4).
        face_vertices: sum(face_sizes), counter-clockwise seen from above.
        face_cell: F, landuse cell (row * 255 + column) at the face's centre. Where that cell's
            centre is on the road, the nearest cell off the road.
    """

    chunk: Chunk
    vertices: FloatArray
    face_sizes: IntArray
    face_vertices: IntArray
    face_cell: IntArray
