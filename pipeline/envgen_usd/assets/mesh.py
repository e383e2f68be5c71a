"""A polygon mesh as arrays, before it becomes a prim."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.models.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Mesh:
    """Faces with normals and texture coordinates; either belongs to vertices or to corners.

    A corner is one place in `face_vertices`. Where an array has a row for each corner its values
    may differ between the faces that meet at a vertex (``faceVarying``).

    Attributes:
        points: N x 3, metres.
        face_sizes: F, vertices of each face.
        face_vertices: C = sum(face_sizes), counter-clockwise seen from outside.
        normals: N x 3 or C x 3, unit length.
        uv: N x 2 or C x 2, in repeats of the texture; v points up in the picture.
        corner_normals: True if `normals` has a row for each corner.
        corner_uv: True if `uv` has a row for each corner.
    """

    points: FloatArray
    face_sizes: IntArray
    face_vertices: IntArray
    normals: FloatArray
    uv: FloatArray
    corner_normals: bool = True
    corner_uv: bool = True

    def extent(self) -> FloatArray:
        """2 x 3, least and greatest coordinates."""
        return np.stack([self.points.min(axis=0), self.points.max(axis=0)])


def face_normals(points: FloatArray, sizes: IntArray, corners: IntArray) -> FloatArray:
    """Area-weighted normals of faces by Newell's method: F x 3, length twice the area."""
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    following = np.arange(1, len(corners) + 1)
    following[starts + sizes - 1] = starts
    here: FloatArray = points[corners]
    total: FloatArray = np.add.reduceat(np.cross(here, here[following]), starts, axis=0)
    return total


def normalised(vectors: FloatArray) -> FloatArray:
    """Vectors of unit length, of any shape ending in 3; zero vectors become +z."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    up = np.broadcast_to([0.0, 0.0, 1.0], vectors.shape)
    return np.where(length > 1e-12, vectors / np.maximum(length, 1e-12), up)


def vertex_normals(points: FloatArray, sizes: IntArray, corners: IntArray) -> FloatArray:
    """Smooth normals, N x 3: the area-weighted mean of the faces around each vertex."""
    weighted: FloatArray = np.repeat(face_normals(points, sizes, corners), sizes, axis=0)
    total: FloatArray = np.stack(
        [np.bincount(corners, weighted[:, axis], minlength=len(points)) for axis in range(3)],
        axis=1,
    )
    return normalised(total)


def flat_normals(points: FloatArray, sizes: IntArray, corners: IntArray) -> FloatArray:
    """Normals for flat shading, C x 3: each corner has its face's."""
    return np.repeat(normalised(face_normals(points, sizes, corners)), sizes, axis=0)


def merge(meshes: Sequence[Mesh]) -> Mesh:
    """One mesh of several that all have normals and texture coordinates at their corners."""
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.face_sizes for mesh in meshes]),
        np.concatenate(
            [mesh.face_vertices + start for mesh, start in zip(meshes, starts, strict=False)]
        ),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
    )


def weld(points: FloatArray, corners: IntArray, grid: float) -> tuple[FloatArray, IntArray]:
    """Makes one vertex of those in the same cell of a grid, and drops those that nobody uses.

    Args:
        points: N x 3, metres.
        corners: Any shape, rows of `points`.
        grid: Metres.

    Returns:
        The points that are left, sorted by place, and the corners' new rows.
    """
    used, index = np.unique(corners, return_inverse=True)
    kept = points[used]
    keys = np.round(kept / grid).astype(np.int64)
    _, first, cell = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return kept[first], cell.reshape(-1)[index.reshape(-1)].reshape(corners.shape)


def welded(mesh: Mesh, grid: float = 1e-6) -> Mesh:
    """The mesh without double vertices; normals and texture coordinates must be the corners'."""
    points, corners = weld(mesh.points, mesh.face_vertices, grid)
    return replace(mesh, points=points, face_vertices=corners)
