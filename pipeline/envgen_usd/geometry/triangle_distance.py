"""Nearest points of triangles."""

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray


def nearest_points(corners: FloatArray, point: FloatArray) -> FloatArray:
    """The point of each triangle that is nearest to a point.

    The nearest point is the foot of the perpendicular where that lies inside the triangle, and
    lies on an edge otherwise.

    Args:
        corners: T x 3 x 3, corners of the triangles.
        point: 3.

    Returns:
        T x 3.
    """
    starts, edges = corners, np.roll(corners, -1, axis=1) - corners
    lengths = np.maximum((edges**2).sum(axis=-1), 1e-300)
    along = np.clip(((point - starts) * edges).sum(axis=-1) / lengths, 0.0, 1.0)
    on_edges = starts + along[..., None] * edges  # T x 3 x 3
    best = ((on_edges - point) ** 2).sum(axis=-1).argmin(axis=1)
    nearest: FloatArray = on_edges[np.arange(len(corners)), best]
    normals = np.cross(edges[:, 0], edges[:, 1])
    areas = (normals**2).sum(axis=-1)
    over = ((point - corners[:, 0]) * normals).sum(axis=-1) / np.maximum(areas, 1e-300)
    feet = point - over[:, None] * normals
    inside = _contain(corners, edges, normals, feet) & (areas > 0.0)
    nearest[inside] = feet[inside]
    return nearest


def _contain(
    corners: FloatArray, edges: FloatArray, normals: FloatArray, feet: FloatArray
) -> BoolArray:
    """True for triangles that contain a point of their plane."""
    sides = np.cross(edges, feet[:, None] - corners)
    contain: BoolArray = ((sides * normals[:, None]).sum(axis=-1) >= 0.0).all(axis=1)
    return contain
