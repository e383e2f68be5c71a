"""Triangles near a camera, joined by material: the geometry of a path tracer."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.render_scene import Floats, Geometry, Indices, Scene

_MOST_CORNERS = 3_000_000
"""Corners that are placed at once; a larger value uses more memory."""


@dataclass(frozen=True)
class JoinedMesh:
    """All near triangles of a material.

    Attributes:
        points: V x 3, metres, relative to the camera, axes of the world.
        normals: V x 3, unit length.
        uvs: V x 2, t up.
        colours: V x 3, sRGB-encoded, 0 to 1.
        triangles: T x 3.
    """

    points: Floats
    normals: Floats
    uvs: Floats
    colours: Floats
    triangles: Indices


def meshes_near(scene: Scene, eye: FloatArray, reach: float) -> dict[int, JoinedMesh]:
    """Places all geometry with a bounding box within `reach` metres of a camera at `eye` (3).

    Returns:
        A mesh for each material, by its index in `Scene.materials`.
    """
    parts: dict[int, list[JoinedMesh]] = defaultdict(list)
    for use in scene.uses:
        if use.level and use.level.far:
            continue
        geometry = scene.geometries[use.geometry]
        matrices = use.matrices[_is_near(geometry.boxes(use.matrices), eye, reach)]
        step = max(_MOST_CORNERS // max(len(geometry.points), 1), 1)
        for first in range(0, len(matrices), step):
            placed = _placed(geometry, matrices[first : first + step], eye)
            parts[geometry.material].append(placed)
    return {material: _joined(meshes) for material, meshes in sorted(parts.items())}


def _is_near(boxes: FloatArray, eye: FloatArray, reach: float) -> BoolArray:
    away = np.maximum(np.maximum(boxes[:, 0] - eye, eye - boxes[:, 1]), 0.0)
    near: BoolArray = np.linalg.norm(away, axis=1) <= reach
    return near


def _placed(geometry: Geometry, matrices: FloatArray, eye: FloatArray) -> JoinedMesh:
    """The geometry at each placement (N x 4 x 4)."""
    turns, shifts = matrices[:, :3, :3], matrices[:, :3, 3] - eye
    points = geometry.points @ turns.transpose(0, 2, 1) + shifts[:, None]
    mirrored = np.linalg.det(turns) < 0.0
    # Normals turn with the cofactor matrix, whose columns are cross products.
    cofactors = np.cross(np.roll(turns, -1, axis=1), np.roll(turns, -2, axis=1), axis=2)
    cofactors[mirrored] *= -1.0
    normals = geometry.normals @ cofactors.transpose(0, 2, 1)
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-20)
    count = len(geometry.points)
    triangles = geometry.triangles + (np.arange(len(matrices)) * count)[:, None, None]
    triangles[mirrored] = triangles[mirrored][..., ::-1]
    colours = geometry.colours[:, :3] / np.float32(255.0)
    return JoinedMesh(
        points.reshape(-1, 3).astype(np.float32),
        normals.reshape(-1, 3).astype(np.float32),
        np.tile(geometry.uvs, (len(matrices), 1)),
        np.tile(colours, (len(matrices), 1)),
        triangles.reshape(-1, 3).astype(np.uint32),
    )


def _joined(meshes: list[JoinedMesh]) -> JoinedMesh:
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    shifted = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]
    return JoinedMesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uvs for mesh in meshes]),
        np.concatenate([mesh.colours for mesh in meshes]),
        np.concatenate(shifted).astype(np.uint32),
    )
