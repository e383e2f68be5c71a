"""What stands still around a place as a tree of triangles, and the first hits of rays."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.lidar.cut_outs import CutOuts
from envgen_usd.render.render_scene import Floats, Geometry, Scene, Use

_DETAIL = 10.0
"""Distance in diagonals of an object up to which it is detailed: it spans 6 degrees there.

A larger value takes more memory, and longer to build.
"""
_GAPS = 64
"""Gaps in leaves through which a ray is followed; a larger value follows it deeper into a wood."""
_STEP = np.float32(1e-4)
"""Distance behind a gap from which a ray is followed, metres.

A larger value misses leaves that touch.
"""
_MIX = np.array((0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9), np.uint64)
"""Odd factors that make a key of the bits of a place."""
_SPLIT = 64
"""Triangles above which those of a mesh that are out of range are left out one by one."""


@dataclass(frozen=True)
class Hits:
    """First hits of rays.

    Attributes:
        ranges: N, distance from the origin, metres; infinite without a hit.
        cosines: N, cosine of the angle of incidence, 0 to 1; of any value without a hit.
        scene_objects: N, index of the scene object; 0 (sky) without a hit.
        materials: N, index of the material; of any value without a hit.
    """

    ranges: Floats
    cosines: Floats
    scene_objects: NDArray[np.uint32]
    materials: IntArray


@dataclass(frozen=True)
class _Mesh:
    """Triangles of many placements.

    Attributes:
        points: V x 3, metres, relative to the tree's middle.
        triangles: T x 3.
        placements: T, number of the placement of each triangle.
        uvs: T x 3 x 2, texture coordinates of the corners; empty for solid materials.
    """

    points: Floats
    triangles: NDArray[np.int32]
    placements: NDArray[np.int32]
    uvs: Floats


class StaticTree:
    """The surfaces around the sensors of a place.

    Rays hit both sides of a surface. They go on through the gaps of cut-out materials.
    """

    def __init__(
        self, scene: Scene, place: FloatArray, reach: float, cut_outs: CutOuts | None = None
    ) -> None:
        """Flattens the placements, and builds the tree.

        Where faces lie in each other, or a ray meets an edge, the whole tree decides which face is
        hit. So scans of one place need one tree to be the same again.

        Args:
            scene: Scene, or a part of it that holds all within reach of the place.
            place: 2 x 2, least and largest x and y of the sensors, world, metres.
            reach: Distance in plan from the place beyond which triangles are left out, metres.
            cut_outs: Those of the scene's materials, which several trees may share.

        Raises:
            EnvgenError: The library embreex is missing.
        """
        scene_type, mesh_type = _embree()
        self.middle = np.append(place.mean(axis=0), scene.bounds[:, 2].mean())
        self.embree = scene_type(robust=True)
        self._cut_outs = cut_outs or CutOuts(scene.materials)
        cut = self._cut_outs.numbers
        parts = list(_parts(scene, _Around(place, self.middle, reach)))
        sky = np.zeros(1, np.uint32)
        self._scene_objects: NDArray[np.uint32] = np.concatenate([*(p.objects for p in parts), sky])
        materials = [np.full(len(p.objects), p.geometry.material) for p in parts]
        self._materials: IntArray = np.concatenate([*materials, sky]).astype(np.int64)
        solid = _mesh([p for p in parts if p.geometry.material not in cut])
        leaves = _mesh([p for p in parts if p.geometry.material in cut], with_uvs=True)
        self._uvs = leaves.uvs
        self._first_leaf = len(solid.triangles)
        none = np.array([len(self._materials) - 1], np.int32)
        self._placements = np.concatenate((solid.placements, leaves.placements, none))
        self._offsets = []
        for first, mesh in ((0, solid), (self._first_leaf, leaves)):
            if len(mesh.triangles):
                mesh_type(self.embree, mesh.points, mesh.triangles)
                self._offsets.append(first)
        if self._offsets:
            ray = np.ones((1, 3), np.float32)
            self.embree.run(ray, ray, dists=0.0)  # builds the tree

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self._placements) - 1

    def cast(self, origins: FloatArray, directions: Floats, reach: float) -> Hits:
        """First hits of rays.

        Args:
            origins: N x 3, or a single one for all rays (3), world, metres.
            directions: N x 3, unit vectors, world.
            reach: Length of the rays, metres.
        """
        starts = np.empty(directions.shape, np.float32)
        starts[:] = origins - self.middle
        triangles, ranges, cosines = self._first_hits(starts, directions, np.float32(reach))
        hit = triangles >= 0
        # Index -1 takes the last row, which stands for no hit.
        placements = self._placements[triangles]
        return Hits(
            ranges=np.where(hit, ranges, np.float32(np.inf)),
            cosines=cosines,
            scene_objects=self._scene_objects[placements],
            materials=self._materials[placements],
        )

    def _first_hits(
        self, starts: Floats, directions: Floats, reach: np.float32
    ) -> tuple[IntArray, Floats, Floats]:
        """Triangle (-1 for none), range and cosine of the first solid hit of each ray."""
        triangles, ranges, cosines, spots = self._run(starts, directions, reach)
        pending = self._gaps(np.arange(len(triangles)), triangles, spots)
        for _ in range(_GAPS):
            if not len(pending):
                break
            before = ranges[pending] + _STEP
            ahead = directions[pending]
            further = starts[pending] + ahead * before[:, None]
            hit, length, cosine, spots = self._run(further, ahead, reach - before)
            triangles[pending], cosines[pending] = hit, cosine
            ranges[pending] = before + length
            pending = self._gaps(pending, hit, spots)
        triangles[pending] = -1
        return triangles, ranges, cosines

    def _run(
        self, starts: Floats, directions: Floats, reach: np.float32 | Floats
    ) -> tuple[IntArray, Floats, Floats, Floats]:
        """Triangle (-1 for none), range, cosine and barycentric coordinates of first hits."""
        count = len(starts)
        if not self._offsets:
            nothing = np.zeros((count, 2), np.float32)
            return np.full(count, -1), nothing[:, 0], nothing[:, 1], nothing
        lengths = np.empty(count, np.float32)
        lengths[:] = reach
        found = self.embree.run(starts, directions, dists=lengths, output=True)
        triangles: IntArray = found["primID"].astype(np.int64)
        hit = triangles >= 0
        triangles[hit] += np.array(self._offsets)[found["geomID"][hit]]
        normals = found["Ng"]
        along = np.abs(np.einsum("ij,ij->i", normals, directions))
        square = np.einsum("ij,ij->i", normals, normals)
        cosines = along / np.sqrt(np.maximum(square, np.float32(1e-30)))
        spots = np.stack((found["u"], found["v"]), axis=1)
        return triangles, found["tfar"], np.minimum(cosines, np.float32(1.0)), spots

    def _gaps(self, rays: IntArray, triangles: IntArray, spots: Floats) -> IntArray:
        """Those of the rays whose hit is a gap in a cut-out material."""
        leaves = np.flatnonzero(triangles >= self._first_leaf)
        if not len(leaves):
            return leaves
        hit = triangles[leaves]
        u, v = spots[leaves].T[:, :, None]
        first, second, third = self._uvs[hit - self._first_leaf].transpose(1, 0, 2)
        uvs = (np.float32(1.0) - u - v) * first + u * second + v * third
        solid = self._cut_outs.are_solid(self._materials[self._placements[hit]], uvs)
        return rays[leaves[~solid]]


def _embree() -> tuple[Any, Any]:
    """The scene and the mesh of embreex, whose wheels do not exist for every platform."""
    try:
        from embreex.mesh_construction import TriangleMesh  # noqa: PLC0415
        from embreex.rtcore_scene import EmbreeScene  # noqa: PLC0415
    except ImportError as error:
        message = "render: lidar needs the library embreex, which exists for x86-64 only"
        raise EnvgenError(f"{message}: pip install embreex") from error
    return EmbreeScene, TriangleMesh


@dataclass(frozen=True)
class _Part:
    """Placements of a geometry within reach.

    Attributes:
        geometry: The geometry.
        points: N x V x 3, metres, relative to the tree's middle.
        triangles: T x 3, those within reach.
        uvs: T x 3 x 2, texture coordinates of their corners.
        objects: N, scene object of each placement.
        first: Number of the first placement.
    """

    geometry: Geometry
    points: Floats
    triangles: IntArray
    uvs: Floats
    objects: NDArray[np.uint32]
    first: int


@dataclass(frozen=True)
class _Around:
    """What counts as near a place; distances are in plan, metres.

    Attributes:
        place: 2 x 2, least and largest x and y.
        middle: 3, origin of the tree.
        reach: Largest distance of what is kept.
    """

    place: FloatArray
    middle: FloatArray
    reach: float

    def holds(self, low: FloatArray, high: FloatArray) -> BoolArray:
        """True for boxes (N x 2 each) within reach."""
        return self._gaps(low, high) <= self.reach

    def is_far(self, places: FloatArray, sizes: FloatArray) -> BoolArray:
        """True for objects (N x 2) of a size (N) that have their far level of detail."""
        return self._gaps(places, places) > _DETAIL * sizes

    def _gaps(self, low: FloatArray, high: FloatArray) -> FloatArray:
        apart = np.maximum(np.maximum(low - self.place[1], self.place[0] - high), 0.0)
        gaps: FloatArray = np.hypot(apart[:, 0], apart[:, 1])
        return gaps


def _parts(scene: Scene, around: _Around) -> Iterator[_Part]:
    first = 0
    for use in scene.uses:
        geometry = scene.geometries[use.geometry]
        kept = _chosen(use, geometry, around) if len(geometry.triangles) else ()
        if not len(kept):
            continue
        matrices = use.matrices[kept]
        corners = geometry.triangles
        if len(kept) == 1 and len(corners) > _SPLIT:
            places = geometry.points @ matrices[0, :3, :3].T + matrices[0, :3, 3]
            corners = corners[_within(places, corners, around)]
        vertices, triangles = _welded(geometry.points, corners)
        points = vertices @ matrices[:, :3, :3].transpose(0, 2, 1)
        points += (matrices[:, :3, 3] - around.middle)[:, None]
        yield _Part(
            geometry=geometry,
            points=points.astype(np.float32),
            triangles=triangles,
            uvs=geometry.uvs[corners],
            objects=use.scene_objects[kept],
            first=first,
        )
        first += len(kept)


def _welded(points: FloatArray, corners: NDArray[np.uint32]) -> tuple[FloatArray, IntArray]:
    """Points that triangles use, each place once, and the triangles between them.

    A library that copies points one by one takes longest for what is the same place.
    """
    words = np.ascontiguousarray(points).view(np.uint64)
    keys = (words * _MIX).sum(axis=1, dtype=np.uint64)[corners.reshape(-1)]
    _, first, triangles = np.unique(keys, return_index=True, return_inverse=True)
    kept = points[corners.reshape(-1)[first]]
    # Two places have one key in a case of 10^9; these points then stay as they are.
    if (kept[triangles.reshape(-1)] != points[corners.reshape(-1)]).any():
        return points, corners.astype(np.int64)
    return kept, triangles.reshape(corners.shape).astype(np.int64)


def _chosen(use: Use, geometry: Geometry, around: _Around) -> IntArray:
    """Numbers of the placements that are within reach and of the right level of detail."""
    boxes = geometry.boxes(use.matrices)[:, :, :2]
    kept = around.holds(boxes[:, 0], boxes[:, 1])
    if use.level is not None and kept.any():
        axes = use.matrices[:, :3, :3]
        middles = (axes @ np.array(use.level.middle) + use.matrices[:, :3, 3])[:, :2]
        sizes = use.level.size * np.cbrt(np.abs(np.linalg.det(axes)))
        kept &= around.is_far(middles, sizes) == use.level.far
    return np.flatnonzero(kept)


def _within(points: FloatArray, triangles: NDArray[np.uint32], around: _Around) -> BoolArray:
    """True for triangles whose box is within reach; points are in the world."""
    low, high = np.empty((2, len(triangles), 2))
    for axis in range(2):
        column = points[:, axis]
        a, b, c = (column[corner] for corner in triangles.T)
        np.minimum(np.minimum(a, b), c, out=low[:, axis])
        np.maximum(np.maximum(a, b), c, out=high[:, axis])
    return around.holds(low, high)


def _mesh(parts: list[_Part], *, with_uvs: bool = False) -> _Mesh:
    points, triangles, placements, uvs = [], [], [], []
    base = 0
    for part in parts:
        count, vertices = part.points.shape[:2]
        starts = base + vertices * np.arange(count)
        triangles.append((part.triangles[None] + starts[:, None, None]).reshape(-1, 3))
        numbers = np.arange(part.first, part.first + count, dtype=np.int32)
        placements.append(np.repeat(numbers, len(part.triangles)))
        points.append(part.points.reshape(-1, 3))
        base += count * vertices
        if with_uvs:
            uvs.append(np.tile(part.uvs, (count, 1, 1)))
    return _Mesh(
        points=_joined(points, np.float32, 3),
        triangles=_joined(triangles, np.int32, 3),
        placements=_joined(placements, np.int32),
        uvs=_joined(uvs, np.float32, 3, 2),
    )


def _joined(arrays: list[Any], kind: Any, *shape: int) -> NDArray[Any]:  # noqa: ANN401 - a dtype
    """The arrays in one, contiguous; without arrays, an empty one."""
    whole = np.concatenate(arrays) if arrays else np.empty((0, *shape))
    return np.ascontiguousarray(whole, kind)
