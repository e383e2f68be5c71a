"""A polygon mesh as arrays, before it becomes a prim."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from envgen_usd.geometry.unique_rows import unique_rows
from envgen_usd.models.array_types import FloatArray, IntArray


@dataclass(frozen=True)
class Mesh:
    """Faces with normals and texture coordinates, each per vertex or per corner.

    A corner is an entry of `face_vertices`. Corner arrays may hold different values for the faces
    that meet at a vertex (``faceVarying``).

    Attributes:
        points: N x 3, metres.
        face_sizes: F, vertices of each face.
        face_vertices: C = sum(face_sizes), counter-clockwise seen from outside.
        normals: N x 3 or C x 3, unit length.
        uv: N x 2 or C x 2, in repeats of the texture; v points up in the image.
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
        """2 x 3, minimum and maximum of the coordinates."""
        return np.stack([self.points.min(axis=0), self.points.max(axis=0)])


def face_normals(points: FloatArray, sizes: IntArray, corners: IntArray) -> FloatArray:
    """Area-weighted face normals by Newell's method: F x 3, length twice the area."""
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    following = np.arange(1, len(corners) + 1)
    following[starts + sizes - 1] = starts
    here: FloatArray = points[corners]
    total: FloatArray = np.add.reduceat(np.cross(here, here[following]), starts, axis=0)
    return total


def normalised(vectors: FloatArray) -> FloatArray:
    """Unit vectors, of any shape that ends in 3; zero vectors become +z."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    up = np.broadcast_to([0.0, 0.0, 1.0], vectors.shape)
    return np.where(length > 1e-12, vectors / np.maximum(length, 1e-12), up)


def vertex_normals(points: FloatArray, sizes: IntArray, corners: IntArray) -> FloatArray:
    """Smooth normals, N x 3: the area-weighted mean of the adjacent faces."""
    weighted: FloatArray = np.repeat(face_normals(points, sizes, corners), sizes, axis=0)
    total: FloatArray = np.stack(
        [np.bincount(corners, weighted[:, axis], minlength=len(points)) for axis in range(3)],
        axis=1,
    )
    return normalised(total)


def flat_normals(points: FloatArray, sizes: IntArray, corners: IntArray) -> FloatArray:
    """Normals for flat shading, C x 3: each corner has the normal of its face."""
    return np.repeat(normalised(face_normals(points, sizes, corners)), sizes, axis=0)


def merge(meshes: Sequence[Mesh]) -> Mesh:
    """Joins meshes whose normals and texture coordinates are all per corner."""
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
    """Merges the points in each cell of a grid, and drops unused points.

    Args:
        points: N x 3, metres.
        corners: Indices of points, of any shape.
        grid: Cell size, metres.

    Returns:
        The remaining points, sorted by position, and the new indices of the corners.
    """
    used, index = np.unique(corners, return_inverse=True)
    kept = points[used]
    keys = np.round(kept / grid).astype(np.int64)
    first, cell = unique_rows(keys)
    return kept[first], cell[index.reshape(-1)].reshape(corners.shape)


def welded(mesh: Mesh, grid: float = 1e-6) -> Mesh:
    """The mesh with merged vertices; normals and texture coordinates must be per corner."""
    points, corners = weld(mesh.points, mesh.face_vertices, grid)
    return replace(mesh, points=points, face_vertices=corners)


def set_apart(mesh: Mesh, share: float = 1e-3) -> Mesh:
    """The mesh with each connected piece shrunk about its middle, so that no two pieces touch.

    Pieces that share a vertex would be co-located if apart, and non-manifold if welded.

    Args:
        mesh: Pieces are faces that share indices of vertices.
        share: Share of its size by which a piece shrinks.
    """
    pieces, piece = _pieces(mesh)
    total = np.bincount(piece, minlength=pieces)
    middle = np.stack(
        [np.bincount(piece, mesh.points[:, axis], pieces) / total for axis in range(3)], axis=1
    )
    return replace(mesh, points=mesh.points + (middle[piece] - mesh.points) * share)


def mesh_pieces(mesh: Mesh) -> tuple[Mesh, ...]:
    """The connected pieces of a mesh, whose normals and texture coordinates are per corner."""
    pieces, piece = _pieces(mesh)
    starts = np.concatenate([[0], np.cumsum(mesh.face_sizes)[:-1]])
    of_face = piece[mesh.face_vertices[starts]]
    of_corner = np.repeat(of_face, mesh.face_sizes)
    found = []
    for number in range(pieces):
        corners = of_corner == number
        used, index = np.unique(mesh.face_vertices[corners], return_inverse=True)
        if len(used):
            sizes = mesh.face_sizes[of_face == number]
            found.append(
                Mesh(mesh.points[used], sizes, index.reshape(-1), mesh.normals[corners],
                     mesh.uv[corners])
            )  # fmt: skip
    return tuple(found)


def _pieces(mesh: Mesh) -> tuple[int, IntArray]:
    """Number of pieces of faces that share vertices, and the piece of each vertex."""
    count = len(mesh.points)
    owner = np.repeat(np.arange(len(mesh.face_sizes)), mesh.face_sizes)
    first = np.concatenate([[0], np.cumsum(mesh.face_sizes)[:-1]])
    pairs = mesh.face_vertices, mesh.face_vertices[first][owner]
    graph = coo_array((np.ones(len(owner)), pairs), shape=(count, count))
    number, piece = connected_components(graph, directed=False)
    return int(number), piece.astype(np.int64)
