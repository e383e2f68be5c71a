"""Shared parts of all payload files: materials, frame, texture coordinates."""

from collections.abc import Iterable

import numpy as np

from envgen_usd.assets.asset_catalogue import Catalogue, LibraryMaterial
from envgen_usd.assets.polygon_mesh import normalised
from envgen_usd.chunks import Chunk
from envgen_usd.models.array_types import FloatArray

STEEP = 0.5
"""Least z of a unit face normal for ground textures; a larger value textures more slopes as walls.

"""
REPEATS = 256
"""Repeats of a texture after which its coordinates start anew; a larger value is less precise."""


def local(points: FloatArray, chunk: Chunk) -> FloatArray:
    """Converts points (N x 3) from the road frame to the frame of the chunk's prim."""
    moved: FloatArray = points - np.array([*chunk.origin, 0.0])
    return moved


def find_materials(
    names: Iterable[str], catalogue: Catalogue, asked_by: str
) -> dict[str, LibraryMaterial]:
    """Returns materials of the library by name.

    Raises:
        EnvgenError: The library lacks a material.
    """
    return {name: catalogue.material(name, asked_by) for name in sorted(set(names))}


def plan_uv(
    points: FloatArray, chunk: Chunk, size: FloatArray | float, angle: FloatArray | float = 0.0
) -> FloatArray:
    """Texture coordinates of level ground, continuous across chunk borders.

    They start anew after `REPEATS` of the texture, so that single precision suffices.

    Args:
        points: N x 3 in the chunk's frame, metres.
        chunk: Tile.
        size: Side length of the texture, metres; a scalar or N values.
        angle: Direction of u, radians from +x; a scalar or N values.
    """
    side, turn = (
        np.broadcast_to(np.asarray(each, dtype=np.float64), (len(points),))[:, None]
        for each in (size, angle)
    )
    place, origin = _turned(points[:, :2], turn), _turned(np.array([chunk.origin]), turn)
    uv: FloatArray = (place + np.fmod(origin, REPEATS * side)) / side
    return uv


def _turned(points: FloatArray, angle: FloatArray) -> FloatArray:
    """Coordinates of points (N x 2) along axes that are turned by angles (N x 1), radians."""
    cos, sin = np.cos(angle[:, 0]), np.sin(angle[:, 0])
    x, y = points.T
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1)


def surface_uv(points: FloatArray, normals: FloatArray, pivot: FloatArray) -> FloatArray:
    """Texture coordinates in metres in the plane of each face, for walls and slopes.

    u is horizontal along the face and v points up its slope; on a level face they are x and y.
    Coplanar faces share their coordinates.

    Args:
        points: N x 3, corners of faces, metres.
        normals: N x 3, unit face normal of each corner.
        pivot: 3, origin of the coordinates, metres.
    """
    level = np.stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))], axis=1)
    flat = np.hypot(normals[:, 0], normals[:, 1])[:, None] < 1e-3
    along = normalised(np.where(flat, [1.0, 0.0, 0.0], level))
    up = np.cross(normals, along)
    place = points - pivot
    return np.stack([(place * along).sum(axis=1), (place * up).sum(axis=1)], axis=1)
