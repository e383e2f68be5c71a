"""A coarse mesh for the distance: vertices of a cell become one.

Rossignac and Borrel 1993, "Multi-resolution 3D approximations for rendering complex scenes".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.assets.asset_design import Model
from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.models.array_types import FloatArray, IntArray

HANGING = ("window", "door")
"""Kinds that fill the box from (0, 0, 0) to (1, depth, 1) and are scaled to their opening."""
FAR_TRIANGLES = 120
"""Most triangles of an asset in the distance; a larger value shows more and draws slower."""
_LEAST = 8
"""Triangles that the coarse mesh of a small part may have; a larger value shows more of it."""
_STEPS = 12
"""Halvings of the range of cell sizes; a larger value comes closer to `FAR_TRIANGLES`."""


def far_model(model: Model) -> Model:
    """The geometry with a coarse part for each part, unless it has some or few triangles."""
    if any(part.proxy_of for part in model.parts):
        return model
    far = [
        replace(part, name=f"{part.name}_far", mesh=mesh, double_sided=True, proxy_of=part.name)
        for part, mesh in zip(model.parts, far_meshes([p.mesh for p in model.parts]), strict=True)
        if mesh is not None
    ]
    return replace(model, parts=(*model.parts, *far))


def far_meshes(meshes: Sequence[Mesh], triangles: int = FAR_TRIANGLES) -> tuple[Mesh | None, ...]:
    """Coarse meshes that share a budget.

    Normals and texture coordinates are those of the corners that remain.

    Args:
        meshes: Meshes of an asset; their normals and texture coordinates are per corner.
        triangles: Most triangles of all coarse meshes together.

    Returns:
        A mesh for each, `None` for a mesh of which nothing remains; only `None` for an asset that
        has few triangles itself.
    """
    soups = [_triangles(mesh) for mesh in meshes]
    if sum(len(soup) for soup in soups) <= 2 * triangles:
        return (None,) * len(meshes)
    share = triangles / sum(len(soup) for soup in soups)
    limits = [max(_LEAST, int(len(soup) * share)) for soup in soups]
    return tuple(
        _within(mesh, soup, limit) for mesh, soup, limit in zip(meshes, soups, limits, strict=True)
    )


def _within(mesh: Mesh, soup: IntArray, limit: int) -> Mesh | None:
    """The finest coarse mesh with so many triangles."""
    low, high = 0.0, float(np.ptp(mesh.extent(), axis=0).max())
    best = _clustered(mesh, soup, high)
    for _ in range(_STEPS):
        cell = (low + high) / 2
        coarse = _clustered(mesh, soup, cell)
        if coarse is None or len(coarse.face_sizes) <= limit:
            best, high = coarse or best, cell
        else:
            low = cell
    return best


def _triangles(mesh: Mesh) -> IntArray:
    """T x 3, corners of the triangles of all faces, as fans."""
    ends = np.cumsum(mesh.face_sizes)
    counts = mesh.face_sizes - 2
    first = np.repeat(ends - mesh.face_sizes, counts)
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def _clustered(mesh: Mesh, soup: IntArray, cell: float) -> Mesh | None:
    """The triangles whose corners stay in three cells; each cell once."""
    keys = np.floor(mesh.points / cell).astype(np.int64)
    _, of_point = np.unique(keys, axis=0, return_inverse=True)
    of_point = of_point.reshape(-1)
    ids = of_point[mesh.face_vertices[soup]]
    kept = (ids[:, 0] != ids[:, 1]) & (ids[:, 1] != ids[:, 2]) & (ids[:, 2] != ids[:, 0])
    _, first = np.unique(np.sort(ids[kept], axis=1), axis=0, return_index=True)
    rows = np.flatnonzero(kept)[np.sort(first)]
    if not len(rows):
        return None
    used, vertices = np.unique(ids[rows].reshape(-1), return_inverse=True)
    at = soup[rows].reshape(-1)
    return Mesh(
        _means(mesh.points, of_point)[used],
        np.full(len(rows), 3),
        vertices.reshape(-1),
        mesh.normals[at],
        mesh.uv[at],
    )


def _means(points: FloatArray, groups: IntArray) -> FloatArray:
    """Mean of the points (N x 3) of each group."""
    sums = np.stack([np.bincount(groups, points[:, axis]) for axis in range(3)], axis=1)
    mean: FloatArray = sums / np.bincount(groups)[:, None]
    return mean
