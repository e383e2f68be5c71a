"""Image boxes of convex bodies behind a lens, which bends their edges."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.render_scene import Geometry

_FEW = 16
"""Number of points below which a convex hull saves nothing."""
_STEP = np.radians(0.5)
"""Largest angle between samples of an edge; a larger value is faster and less exact."""
_HALVINGS = 10
"""Halvings of the samples where an edge leaves the field of the lens; more are more exact."""


@dataclass(frozen=True)
class Hull:
    """The convex hull of a mesh.

    Attributes:
        corners: N x 3.
        edges: E x 2, indices into `corners`; diagonals may be among them.
    """

    corners: FloatArray
    edges: NDArray[np.intp]

    def placed(self, matrix: FloatArray) -> "Hull":
        """The hull after a transformation, 4 x 4."""
        return Hull(self.corners @ matrix[:3, :3].T + matrix[:3, 3], self.edges)


def hull_of(geometry: Geometry) -> Hull:
    """The convex hull of a mesh; of few points, all."""
    points = np.unique(geometry.points[np.unique(geometry.triangles)].astype(np.float64), axis=0)
    if len(points) <= _FEW:
        return Hull(points, _pairs(len(points)))
    try:
        body = ConvexHull(points)
        sides = np.concatenate([body.simplices[:, pair] for pair in combinations(range(3), 2)])
    except QhullError:
        return _flat_hull(points)
    return _with_corners(points, sides)


def _pairs(count: int) -> NDArray[np.intp]:
    return np.array(list(combinations(range(count), 2)), np.intp).reshape(-1, 2)


def _flat_hull(points: FloatArray) -> Hull:
    """The hull of points on a plane or a line."""
    moved = points - points.mean(axis=0)
    plan = moved @ np.linalg.svd(moved, full_matrices=False)[2][:2].T
    try:
        return _with_corners(points, ConvexHull(plan).simplices)
    except QhullError:
        order = np.argsort(plan[:, 0])
        return _with_corners(points, order[[0, -1]][None])


def _with_corners(points: FloatArray, sides: NDArray[np.signedinteger[Any]]) -> Hull:
    kept, edges = np.unique(np.sort(sides, axis=1), return_inverse=True)
    return Hull(points[kept], np.unique(edges.reshape(-1, 2), axis=0))


def lens_box(
    camera: Camera, pose: Pose, hulls: Sequence[Hull]
) -> tuple[tuple[float, float, float, float] | None, bool]:
    """Left, top, right and bottom of convex bodies (world) in the image of any lens.

    A lens maps directions continuously, and the outline of a convex body consists of edges. So the
    least and the largest column and row are on edges, which are sampled.

    Returns:
        The box, and True if the whole bodies lie in the field of the lens. `None` if no edge does.
    """
    eye, axes = pose.matrix[:3, 3], pose.matrix[:3, :3]
    ends = [(hull.corners - eye) @ axes for hull in hulls]
    first = np.concatenate([e[hull.edges[:, 0]] for e, hull in zip(ends, hulls, strict=True)])
    last = np.concatenate([e[hull.edges[:, 1]] for e, hull in zip(ends, hulls, strict=True)])
    samples, follows = _arcs(first, last)
    places = camera.lens.project(samples)
    seen = ~np.isnan(places[:, 0])
    borders = camera.lens.project(_borders(camera, samples, seen, follows))
    found = np.concatenate((places[seen], borders))
    if not len(found):
        return None, False
    u, v = (found * (camera.fx, camera.fy) + (camera.cx + 0.5, camera.cy + 0.5)).T
    return (float(u.min()), float(v.min()), float(u.max()), float(v.max())), bool(seen.all())


def _arcs(first: FloatArray, last: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Unit directions along edges (E x 3 each), and which of them follow another of their edge."""
    first, last = _unit(first), _unit(last)
    angles = np.arctan2(
        np.linalg.norm(np.cross(first, last), axis=1), np.einsum("ij,ij->i", first, last)
    )
    counts = np.maximum(np.ceil(angles / _STEP).astype(np.intp), 1) + 1
    edge = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = (step / (counts[edge] - 1))[:, None]
    angle = angles[edge, None]
    near, far = np.sin((1.0 - share) * angle), np.sin(share * angle)
    # Where the ends are one direction, or opposite ones, there is no arc between them.
    plain = np.sin(angle) < 1e-9
    near, far = np.where(plain, 1.0 - share, near), np.where(plain, share, far)
    return _unit(near * first[edge] + far * last[edge]), step > 0


def _borders(
    camera: Camera, samples: FloatArray, seen: BoolArray, follows: BoolArray
) -> FloatArray:
    """Directions within the field, close to where edges leave it."""
    changes = np.flatnonzero(follows & (seen != np.roll(seen, 1)))
    inner = np.where(seen[changes], changes, changes - 1)
    outer = np.where(seen[changes], changes - 1, changes)
    within, beyond = samples[inner], samples[outer]
    for _ in range(_HALVINGS):
        middle = _unit(within + beyond)
        is_seen = ~np.isnan(camera.lens.project(middle)[:, :1])
        within, beyond = np.where(is_seen, middle, within), np.where(is_seen, beyond, middle)
    return within


def _unit(vectors: FloatArray) -> FloatArray:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: FloatArray = vectors / np.maximum(lengths, 1e-300)
    return unit
