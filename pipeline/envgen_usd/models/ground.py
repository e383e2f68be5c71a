"""Height of the ground, and the ground as a mesh."""

from collections.abc import Callable
from dataclasses import dataclass

from envgen_usd.chunks import Chunk
from envgen_usd.models.arrays import FloatArray, IntArray

Heights = Callable[[FloatArray], FloatArray]
"""Heights (N, metres) at places (N x 2)."""


@dataclass(frozen=True)
class HeightMap:
    """Ground height of one chunk.

    Attributes:
        chunk: The tile.
        heights: 256 x 256, metres, road frame; row j, column i lies at
            ``(chunk.corner_axes()[0][i], chunk.corner_axes()[1][j])``, so row 0 is the south edge.
    """

    chunk: Chunk
    heights: FloatArray


@dataclass(frozen=True)
class GroundMesh:
    """Ground of one chunk: grid quads away from the road, triangles stitched to its outline.

    Attributes:
        chunk: The tile.
        vertices: V x 3, metres, road frame, on `chunks.GRID`.
        face_sizes: F, vertices of each face (3 or 4).
        face_vertices: sum(face_sizes), counter-clockwise seen from above.
        face_cell: F, landuse cell (row * 255 + column) in which the face's centre lies, or the
            next one to it where the centre of that cell is on the road.
    """

    chunk: Chunk
    vertices: FloatArray
    face_sizes: IntArray
    face_vertices: IntArray
    face_cell: IntArray
