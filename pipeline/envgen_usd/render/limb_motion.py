"""Motion inside bodies that replace each other: the phases of a walk are the same mesh, bent."""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.render_scene import Moment, MovingParts

_SPACING = 0.01
"""Distance of samples on a surface, shares of its diagonal; a larger value may miss triangles."""
_MOST_ROWS = 32
"""Most rows of samples on a triangle, which are wider apart on larger ones."""
_CANDIDATES = 12
"""Samples whose triangles are tried for a point; more cost more time."""
_TINY = 1e-30


class _Surface:
    """Triangles of a body, found by samples on them."""

    def __init__(self, corners: FloatArray) -> None:
        """Takes the corners of the triangles, T x 3 x 3, in the space of the body."""
        self.corners = corners

    @cached_property
    def _samples(self) -> tuple[cKDTree, IntArray]:
        """Samples, and the triangle of each. The poses that only follow need none."""
        return _sampled(self.corners)

    def places(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """The nearest triangle of each point (N x 3), and barycentric coordinates on it, N x 3."""
        tree, triangles = self._samples
        count = min(_CANDIDATES, len(triangles))
        found = tree.query(points, count)[1].reshape(len(points), count)
        tried = triangles[found]  # N x k
        corners = self.corners[tried]  # N x k x 3 x 3
        shares = _barycentric(points[:, None], corners)
        apart = np.einsum("nki,nkij->nkj", shares, corners) - points[:, None]
        best = np.argmin((apart**2).sum(axis=2), axis=1)
        rows = np.arange(len(points))
        return tried[rows, best], shares[rows, best]


class PoseSurfaces:
    """Surfaces of the bodies of a stage, and which of them are poses of the same mesh."""

    def __init__(self, moving: MovingParts) -> None:
        """Makes no surface yet.

        Args:
            moving: What moves.
        """
        self._moving = moving
        self._surfaces: dict[Hashable, _Surface] = {}

    def successors(self, moment: Moment, following: Moment) -> IntArray:
        """The body that takes the place of each body in the next frame, K; -1 for none.

        It belongs to the same object, was hidden, and has the same meshes in another pose: as many
        triangles of the same materials. Of several such bodies, as the wheels of a bicycle, each
        takes the place of that with the same rank.

        Args:
            moment: Moment of this frame.
            following: Moment of the next frame.
        """
        drawn = np.array([len(each) > 0 for each in self._moving.layouts], bool)
        owners = self._moving.owners
        gone = np.flatnonzero(drawn & moment.shown & ~following.shown)
        new = np.flatnonzero(drawn & ~moment.shown & following.shown)
        found = np.full(len(owners), -1)
        for owner in np.unique(owners[gone]).tolist():
            hidden = self._by_kind(gone[owners[gone] == owner])
            shown = self._by_kind(new[owners[new] == owner])
            for kind, bodies in hidden.items():
                for body, other in zip(bodies, shown.get(kind, ()), strict=False):
                    found[body] = other
        return found

    def _by_kind(self, bodies: IntArray) -> dict[Hashable, list[int]]:
        """Bodies of equal meshes, in their order."""
        kinds: dict[Hashable, list[int]] = {}
        for body in bodies.tolist():
            kinds.setdefault(tuple(self._kind(body)), []).append(body)
        return kinds

    def moved(self, points: FloatArray, body: int, successor: int) -> FloatArray:
        """Points on a body (N x 3, in its space), in the space of its successor."""
        triangles, shares = self._surface(body).places(points)
        corners = self._surface(successor).corners[triangles]
        moved: FloatArray = np.einsum("ni,nij->nj", shares, corners)
        return moved

    def _kind(self, body: int) -> list[tuple[int, int, bool]]:
        """Material, number of triangles and level of detail of each mesh."""
        uses, geometries = self._moving.uses, self._moving.geometries
        kind = []
        for number, _ in self._moving.layouts[body].tolist():
            use = uses[number]
            geometry = geometries[use.geometry]
            far = use.level is not None and use.level.far
            kind.append((geometry.material, len(geometry.triangles), far))
        return kind

    def _surface(self, body: int) -> _Surface:
        layout = self._moving.layouts[body]
        placed = [self._moving.uses[use].matrices[row] for use, row in layout.tolist()]
        key = (*layout[:, 0].tolist(), np.concatenate(placed).tobytes())
        if key not in self._surfaces:
            corners = [
                self._corners(use, matrix)
                for use, matrix in zip(layout[:, 0].tolist(), placed, strict=True)
            ]
            self._surfaces[key] = _Surface(np.concatenate(corners))
        return self._surfaces[key]

    def _corners(self, use: int, matrix: FloatArray) -> FloatArray:
        geometry = self._moving.geometries[self._moving.uses[use].geometry]
        points = geometry.points @ matrix[:3, :3].T + matrix[:3, 3]
        corners: FloatArray = points[geometry.triangles]
        return corners


@dataclass(frozen=True)
class LimbMotion:
    """What bends from a frame to the next.

    Attributes:
        surfaces: Surfaces of the bodies.
        successors: K, the body that takes the place of each body; -1 for none.
        moment: Moment of this frame.
        following: Moment of the next frame.
    """

    surfaces: PoseSurfaces
    successors: IntArray
    moment: Moment
    following: Moment

    def moved(self, points: FloatArray, bodies: IntArray) -> tuple[IntArray, FloatArray]:
        """Moves the points on bodies that bend.

        Args:
            points: N x 3, world.
            bodies: N, body of each point.

        Returns:
            Numbers of the points that bend (M), and where they are in the next frame, M x 3.
        """
        bent = np.flatnonzero(self.successors[bodies] >= 0)
        moved = np.empty((len(bent), 3))
        for body in np.unique(bodies[bent]).tolist():
            rows = np.flatnonzero(bodies[bent] == body)
            successor = int(self.successors[body])
            own = _transformed(np.linalg.inv(self.moment.matrices[body]), points[bent[rows]])
            there = self.surfaces.moved(own, body, successor)
            moved[rows] = _transformed(self.following.matrices[successor], there)
        return bent, moved


def _transformed(matrix: FloatArray, points: FloatArray) -> FloatArray:
    moved: FloatArray = points @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def _sampled(corners: FloatArray) -> tuple[cKDTree, IntArray]:
    """Lays samples on triangles, T x 3 x 3, and returns the triangle of each."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    spacing = _SPACING * max(float(np.linalg.norm(np.ptp(corners, axis=(0, 1)))), 1e-12)
    rows = np.clip(np.ceil(sides / spacing), 1, _MOST_ROWS).astype(np.int64)
    points, triangles = [], []
    for count in np.unique(rows).tolist():
        those = np.flatnonzero(rows == count)
        first, second = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
        inside = first + second < count
        u, v = (first[inside] + 1 / 3) / count, (second[inside] + 1 / 3) / count
        shares = np.stack((1.0 - u - v, u, v), axis=1)  # S x 3
        points.append(np.einsum("si,tij->tsj", shares, corners[those]).reshape(-1, 3))
        triangles.append(np.repeat(those, len(shares)))
    return cKDTree(np.concatenate(points)), np.concatenate(triangles)


def _barycentric(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Barycentric coordinates (... x 3) of points within triangles, ... x 3 x 3; inside of them."""
    u, v = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    w = points - corners[..., 0, :]
    uu, uv, vv = (u * u).sum(axis=-1), (u * v).sum(axis=-1), (v * v).sum(axis=-1)
    uw, vw = (u * w).sum(axis=-1), (v * w).sum(axis=-1)
    area = np.maximum(uu * vv - uv * uv, _TINY)
    second, third = (vv * uw - uv * vw) / area, (uu * vw - uv * uw) / area
    shares = np.clip(np.stack((1.0 - second - third, second, third), axis=-1), 0.0, 1.0)
    inside: FloatArray = shares / shares.sum(axis=-1, keepdims=True)
    return inside
