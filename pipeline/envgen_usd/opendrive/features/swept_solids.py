"""Surfaces of simple bodies: prisms over outlines, tubes, and swept sections.

A body is an array of triangles, T x 3 x 3 (corners, coordinates), counter-clockwise from outside.
"""

from collections.abc import Sequence

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons

_SIDES = 8
"""Sides of a tube; a larger value gives a rounder tube."""


def polygons(bodies: Sequence[FloatArray]) -> Polygons:
    """Returns the triangles of all bodies on the coordinate grid, without degenerate triangles."""
    corners = snap(np.concatenate(bodies)) if bodies else np.empty((0, 3, 3))
    a, b, c = corners.transpose(1, 0, 2)
    kept = corners[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9]
    return Polygons.of_triangles(kept.reshape(-1, 3), np.arange(3 * len(kept)).reshape(-1, 3))


def sweep(rings: FloatArray, lid: IntArray) -> FloatArray:
    """Returns a closed surface through cross-sections.

    Args:
        rings: N x K x 3, metres, consecutive cross-sections; counter-clockwise as seen from the
            end of the sweep.
        lid: L x 3, triangles of corners that fill a cross-section, counter-clockwise.
    """
    count, corners = rings.shape[:2]
    ring, corner = np.meshgrid(np.arange(count - 1), np.arange(corners), indexing="ij")
    a = (ring * corners + corner).ravel()
    b = (ring * corners + (corner + 1) % corners).ravel()
    sides = np.concatenate(
        [np.stack([a, b, b + corners]), np.stack([a, b + corners, a + corners])], 1
    )
    caps = [lid[:, ::-1], lid + (count - 1) * corners]
    body: FloatArray = rings.reshape(-1, 3)[np.concatenate([sides.T, *caps])]
    return body


def tube(line: FloatArray, radius: FloatArray) -> FloatArray:
    """Returns a round tube along a smooth line (N x 3) with a radius (N) at each point, metres."""
    direction = np.gradient(line, axis=0)
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)
    side = np.cross(direction, np.where(np.abs(direction[:, 2:]) < 0.9, [0.0, 0, 1], [1.0, 0, 0]))
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    up = np.cross(side, direction)
    angle = np.arange(_SIDES) * (2 * np.pi / _SIDES)
    spokes = -side[:, None] * np.cos(angle)[:, None] + up[:, None] * np.sin(angle)[:, None]
    corner = np.arange(1, _SIDES - 1)
    lid = np.stack([np.zeros_like(corner), corner, corner + 1], axis=1)
    return sweep(line[:, None] + spokes * radius[:, None, None], lid)


def prism(bottom: FloatArray, height: FloatArray) -> FloatArray:
    """Returns a closed body between an outline (N x 3, either orientation) and its raised copy.

    Args:
        bottom: N x 3, corners of the lower face, metres.
        height: N, metres, height of the body at each corner.
    """
    bottom, height = counter_clockwise(bottom, height)
    count = len(bottom)
    points = np.concatenate([bottom, bottom + np.outer(height, (0.0, 0.0, 1.0))])
    a = np.arange(count)
    b = (a + 1) % count
    sides = np.concatenate([np.stack([a, b, b + count]), np.stack([a, b + count, a + count])], 1).T
    lid = flat_triangles(bottom[:, :2])
    body: FloatArray = points[np.concatenate([sides, lid + count, lid[:, ::-1]])]
    return body


def curtain(line: FloatArray, height: FloatArray) -> FloatArray:
    """Returns an upright strip over an open line (N x 3), visible from both sides."""
    top = line + np.outer(height, (0.0, 0.0, 1.0))
    points = np.concatenate([line, top])
    a = np.arange(len(line) - 1)
    b, up = a + 1, len(line)
    front = np.concatenate([np.stack([a, b, b + up]), np.stack([a, b + up, a + up])], 1).T
    body: FloatArray = points[np.concatenate([front, front[:, ::-1]])]
    return body


def counter_clockwise(ring: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns a ring (N x 3) and its N values counter-clockwise, without repeated corners."""
    kept = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1) > 1e-3
    ring, values = ring[kept], values[kept]
    following = np.roll(ring, -1, axis=0)
    area = (ring[:, 0] * following[:, 1] - following[:, 0] * ring[:, 1]).sum()
    return (ring[::-1], values[::-1]) if area < 0 else (ring, values)


def flat_triangles(ring: FloatArray) -> IntArray:
    """Returns triangles (T x 3, indices) that fill a simple ring (N x 2); empty if not simple."""
    polygon = shapely.Polygon(ring)
    if not polygon.is_valid or polygon.area == 0:
        return np.empty((0, 3), dtype=np.int64)
    parts = shapely.constrained_delaunay_triangles(polygon).geoms
    corners = np.array([part.exterior.coords[:3] for part in parts])  # T x 3 x 2
    distance = np.linalg.norm(corners[:, :, None] - ring, axis=-1)
    triangles: IntArray = distance.argmin(axis=-1)
    a, b, c = corners.transpose(1, 0, 2)
    turned = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles
