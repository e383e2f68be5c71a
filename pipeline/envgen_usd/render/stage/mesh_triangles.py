"""Triangulates the polygons of a mesh."""

import manifold3d
import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray

_EPSILON = 1e-12


def triangulate(
    points: FloatArray, sizes: IntArray, corners: IntArray
) -> tuple[IntArray, IntArray]:
    """Triangulates the faces of a mesh.

    Convex faces become fans. Other faces are triangulated by constrained Delaunay in their plane.
    Faces with fewer than three corners are dropped.

    Args:
        points: V x 3.
        sizes: F, number of corners of each face.
        corners: sum(sizes), point index of each corner.

    Returns:
        Triangles as T x 3 indices into `corners`, and the face of each triangle, T.
    """
    starts = np.concatenate(([0], np.cumsum(sizes)[:-1])).astype(np.int64)
    counts = np.maximum(sizes - 2, 0)
    face = np.repeat(np.arange(len(sizes)), counts)
    step = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    first = starts[face]
    fan = np.stack((first, first + step + 1, first + step + 2), axis=1)  # T x 3
    bent = _bent_faces(points, sizes, corners, fan, face)
    if not len(bent):
        return fan, face
    keep = ~np.isin(face, bent)
    cut = [_cut(points, corners[starts[f] : starts[f] + sizes[f]]) + starts[f] for f in bent]
    pieces = [fan[keep], *cut]
    faces = [face[keep], *(np.full(len(part), f) for part, f in zip(cut, bent, strict=True))]
    triangles, owners = np.concatenate(pieces), np.concatenate(faces)
    order = np.argsort(owners, kind="stable")
    return triangles[order], owners[order]


def _bent_faces(
    points: FloatArray, sizes: IntArray, corners: IntArray, fan: IntArray, face: IntArray
) -> IntArray:
    """Faces with a fan triangle that opposes the face's normal."""
    several = sizes[face] > 3
    if not several.any():
        return np.empty(0, np.int64)
    face = face[several]
    first, second, third = corners[fan[several].T]
    # A row of memory for each coordinate: three times as fast as a row for each point.
    sides = [(row[second] - row[first], row[third] - row[first]) for row in points.T.copy()]
    (ux, vx), (uy, vy), (uz, vz) = sides
    against = np.zeros(len(face))
    for area in (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx):
        against += area * np.bincount(face, area, len(sizes))[face]
    return np.unique(face[against < -_EPSILON])


def _cut(points: FloatArray, ring: IntArray) -> IntArray:
    """Triangles (indices into the ring) of a simple polygon in space."""
    corners = points[ring] - points[ring[0]]
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    normal = normal / max(np.linalg.norm(normal), _EPSILON)
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(helper, normal)
    u = u / np.linalg.norm(u)
    flat = np.stack((corners @ u, corners @ np.cross(normal, u)), axis=1)
    triangles = np.asarray(manifold3d.triangulate([flat]), np.int64)
    return triangles.reshape(-1, 3)
