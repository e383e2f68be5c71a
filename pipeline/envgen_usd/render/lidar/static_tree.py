"""What stands still around a place as trees of triangles, and the first hits of rays."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.lidar.cut_outs import CutOuts
from envgen_usd.render.lidar.embree_library import FirstHits, PlacedTrees
from envgen_usd.render.lidar.tree_store import RegionTree, TreeStore
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
_LEAST = np.float32(1e-30)


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


class StaticTree:
    """The surfaces around the sensors of a place.

    Rays hit both sides of a surface. They go on through the gaps of cut-out materials. Trees of
    regions and of geometries are in a store; a place adds the tree of their placements alone.
    """

    def __init__(
        self,
        scene: Scene,
        place: FloatArray,
        reach: float,
        cut_outs: CutOuts | None = None,
        store: TreeStore | None = None,
    ) -> None:
        """Places the trees of what is within reach.

        Where faces lie in each other, or a ray meets an edge, the whole tree decides which face is
        hit. So scans of one place need one tree to be the same again.

        Args:
            scene: Scene, or a part of it that holds all within reach of the place.
            place: 2 x 2, least and largest x and y of the sensors, world, metres.
            reach: Distance in plan from the place beyond which placements are left out, metres.
            cut_outs: Those of the scene's materials, which several trees may share.
            store: Trees of the scene's geometries, which several places may share.

        Raises:
            EnvgenError: The library embreex is missing.
        """
        self.middle = np.append(place.mean(axis=0), scene.bounds[:, 2].mean())
        self._cut_outs = cut_outs or CutOuts(scene.materials)
        store = store or TreeStore()
        parts = store.parts(scene, self._cut_outs.numbers)
        placed = _placed(parts.others, store, place, reach)
        self._surfaces = _Surfaces(parts.regions, placed, self._cut_outs)
        shifts = np.array([region.matrix for region in parts.regions]).reshape(-1, 4, 4)
        matrices = np.concatenate((shifts, placed.matrices))
        matrices[:, :3, 3] -= self.middle
        trees = [region.tree for region in parts.regions]
        trees += [store.tree(placed.geometries[number]) for number in placed.numbers.tolist()]
        self.trees = PlacedTrees(trees, matrices)
        self._normals = np.linalg.inv(matrices[:, :3, :3]).transpose(0, 2, 1).astype(np.float32)
        self._shifted = len(parts.regions)
        self.triangles = sum(tree.triangles for tree in trees)

    def cast(
        self,
        origins: FloatArray,
        directions: Floats,
        reach: float,
        order: IntArray | None = None,
    ) -> Hits:
        """First hits of rays.

        Args:
            origins: N x 3, or a single one for all rays (3), world, metres.
            directions: N x 3, unit vectors, world.
            reach: Length of the rays, metres.
            order: N, numbers of the rays, so that 16 that follow each other go similar ways; `None`
                if they do not.
        """
        eyes = (np.asarray(origins) - self.middle).astype(np.float32)
        starts: Floats = np.broadcast_to(eyes, directions.shape)
        length = np.float32(reach)
        if order is None:
            return self._cast(starts, directions, length, coherent=False)
        sorted_starts = starts[order] if eyes.ndim > 1 else starts
        found = self._cast(sorted_starts, directions[order], length, coherent=True)
        back = np.empty_like(order)
        back[order] = np.arange(len(order))
        return Hits(
            found.ranges[back],
            found.cosines[back],
            found.scene_objects[back],
            found.materials[back],
        )

    def _cast(
        self, starts: Floats, directions: Floats, reach: np.float32, *, coherent: bool
    ) -> Hits:
        found = self.trees.first_hits(starts, directions, reach, coherent=coherent)
        ranges = np.where(found.triangles >= 0, found.ranges, np.float32(np.inf))
        cosines = self._cosines(found, directions)
        objects, materials = self._surfaces.of(found)
        pending = self._gaps(np.arange(len(ranges)), found, materials)
        for _ in range(_GAPS):
            if not len(pending):
                break
            before, ahead = ranges[pending] + _STEP, directions[pending]
            further = starts[pending] + ahead * before[:, None]
            found = self.trees.first_hits(further, ahead, reach - before, coherent=coherent)
            hit = found.triangles >= 0
            ranges[pending] = np.where(hit, before + found.ranges, np.float32(np.inf))
            cosines[pending] = self._cosines(found, ahead)
            objects[pending], materials[pending] = self._surfaces.of(found)
            pending = self._gaps(pending, found, materials[pending])
        ranges[pending], objects[pending] = np.inf, 0
        return Hits(ranges, cosines, objects, materials)

    def _cosines(self, found: FirstHits, directions: Floats) -> Floats:
        """Cosine between ray and normal."""
        normals = found.normals
        turned = np.flatnonzero(found.placements >= self._shifted)
        turns = self._normals[found.placements[turned]]
        normals[turned] = np.einsum("nij,nj->ni", turns, normals[turned])
        along = np.abs(np.einsum("ij,ij->i", normals, directions))
        square = np.einsum("ij,ij->i", normals, normals)
        cosines: Floats = np.minimum(along / np.sqrt(np.maximum(square, _LEAST)), np.float32(1.0))
        return cosines

    def _gaps(self, rays: IntArray, found: FirstHits, materials: IntArray) -> IntArray:
        """Those of the rays whose hit is a gap in a cut-out material."""
        leaves, uvs = self._surfaces.leaf_spots(found)
        solid = self._cut_outs.are_solid(materials[leaves], uvs)
        return rays[leaves[~solid]]


@dataclass(frozen=True)
class _Placed:
    """Placements within reach.

    Attributes:
        geometries: Geometries that are placed.
        numbers: N, number of the geometry.
        matrices: N x 4 x 4, to the world.
        scene_objects: N.
    """

    geometries: tuple[Geometry, ...]
    numbers: IntArray
    matrices: FloatArray
    scene_objects: NDArray[np.uint32]


class _Surfaces:
    """Scene objects, materials and texture coordinates of hits."""

    def __init__(self, regions: Sequence[RegionTree], placed: _Placed, cut_outs: CutOuts) -> None:
        """Joins the tables of regions and placements.

        Rows of regions come first, a row for each triangle; then a row for each placement, and one
        that stands for no hit.
        """
        sizes = np.array([len(region.materials) for region in regions], np.int64)
        first = np.concatenate(([0], np.cumsum(sizes))).astype(np.int64)
        count = len(placed.numbers)
        self._first = np.concatenate((first[:-1], first[-1] + np.arange(count)))
        self._by_triangle = len(regions)
        none = np.zeros(1, np.uint32)
        objects = [*(region.scene_objects for region in regions), placed.scene_objects, none]
        self._objects: NDArray[np.uint32] = np.concatenate(objects)
        own = np.array([geometry.material for geometry in placed.geometries], np.int64)
        materials: list[NDArray[Any]] = [region.materials for region in regions]
        materials += [own[placed.numbers], none]
        self._materials: IntArray = np.concatenate(materials).astype(np.int64)
        leaves = [
            number
            for number, geometry in enumerate(placed.geometries)
            if geometry.material in cut_outs.numbers
        ]
        self._uvs, starts = _corner_uvs([placed.geometries[number] for number in leaves])
        first_uv = np.full(len(placed.geometries), -1, np.int64)
        first_uv[leaves] = starts
        self._first_uv = np.concatenate((np.full(len(regions), -1), first_uv[placed.numbers]))

    def of(self, found: FirstHits) -> tuple[NDArray[np.uint32], IntArray]:
        """Scene object and material of each hit; those of the last row without a hit."""
        rows = np.full(len(found.triangles), len(self._objects) - 1)
        hit = np.flatnonzero(found.triangles >= 0)
        placements = found.placements[hit]
        rows[hit] = self._first[placements]
        rows[hit] += np.where(placements < self._by_triangle, found.triangles[hit], 0)
        return self._objects[rows], self._materials[rows]

    def leaf_spots(self, found: FirstHits) -> tuple[IntArray, Floats]:
        """Numbers of the hits on materials with gaps, and their texture coordinates (M x 2)."""
        hit = np.flatnonzero(found.triangles >= 0)
        first = self._first_uv[found.placements[hit]]
        leaves, first = hit[first >= 0], first[first >= 0]
        u, v = found.spots[leaves].T[:, :, None]
        one, two, three = self._uvs[first + found.triangles[leaves]].transpose(1, 0, 2)
        return leaves, (np.float32(1.0) - u - v) * one + u * two + v * three


def _corner_uvs(geometries: Sequence[Geometry]) -> tuple[Floats, IntArray]:
    """Texture coordinates of all corners (T x 3 x 2), and where those of a geometry begin."""
    tables = [np.empty((0, 3, 2), np.float32)]
    tables += [geometry.uvs[geometry.triangles].astype(np.float32) for geometry in geometries]
    starts = np.cumsum([len(table) for table in tables])[:-1]
    return np.concatenate(tables), starts.astype(np.int64)


def _placed(
    uses: Sequence[tuple[Use, Geometry]], store: TreeStore, place: FloatArray, reach: float
) -> _Placed:
    """Placements within reach and of the right level of detail."""
    counts = np.array([len(use.matrices) for use, _ in uses], np.int64)
    owners = np.repeat(np.arange(len(uses)), counts)
    matrices = np.concatenate([np.empty((0, 4, 4)), *(use.matrices for use, _ in uses)])
    axes, shifts = matrices[:, :3, :3], matrices[:, :3, 3]
    extents = np.array([store.extent(geometry) for _, geometry in uses]).reshape(-1, 2, 3)
    middles, halves = extents.mean(axis=1), np.ptp(extents, axis=1) / 2.0
    centres = np.einsum("nij,nj->ni", axes, middles[owners]) + shifts
    sides = np.einsum("nij,nj->ni", np.abs(axes), halves[owners])
    kept = _gaps(place, centres - sides, centres + sides) <= reach
    levels = [use.level for use, _ in uses]
    levelled = np.array([level is not None for level in levels], bool)[owners]
    heads = np.array([level.middle if level else (0.0, 0.0, 0.0) for level in levels])
    sizes = np.array([level.size if level else 0.0 for level in levels])
    far = np.array([level.far if level else False for level in levels], bool)
    eyes = np.einsum("nij,nj->ni", axes, heads.reshape(-1, 3)[owners]) + shifts
    scales = np.cbrt(np.abs(np.linalg.det(axes)))
    is_far = _gaps(place, eyes, eyes) > _DETAIL * sizes[owners] * scales
    kept &= ~levelled | (is_far == far[owners])
    chosen = owners[kept]
    objects = [np.empty(0, np.uint32), *(use.scene_objects for use, _ in uses)]
    shown, numbers = np.unique(chosen, return_inverse=True)
    return _Placed(
        geometries=tuple(uses[number][1] for number in shown.tolist()),
        numbers=numbers,
        matrices=matrices[kept],
        scene_objects=np.concatenate(objects)[kept],
    )


def _gaps(place: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Distance in plan of boxes (N x 3 each) from a place (2 x 2), metres."""
    apart = np.maximum(np.maximum(low[:, :2] - place[1], place[0] - high[:, :2]), 0.0)
    gaps: FloatArray = np.hypot(apart[:, 0], apart[:, 1])
    return gaps
