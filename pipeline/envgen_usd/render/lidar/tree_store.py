"""Trees of a stage's meshes, each built once."""

import weakref
from collections import OrderedDict, defaultdict
from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.lidar.embree_library import TriangleTree
from envgen_usd.render.render_scene import Geometry, Scene, Use

_JOINED = 20_000
"""Triangles of a use up to which its placements are joined with others of its region; one alone
always is.

A larger value takes more memory, since each placement has triangles of its own, and makes fewer
trees that lie in each other.
"""
_KEPT = 4_000_000
"""Triangles of regions that are kept for later places, about 130 bytes each; a larger value builds
trees less often."""


@dataclass(frozen=True, eq=False)
class RegionTree:
    """What is drawn at all distances in a region, as one tree.

    Attributes:
        tree: The tree.
        matrix: 4 x 4, from the tree's space to the world: a shift.
        scene_objects: T, scene object of each triangle.
        materials: T, material of each triangle.
    """

    tree: TriangleTree
    matrix: FloatArray
    scene_objects: NDArray[np.uint32]
    materials: IntArray


@dataclass(frozen=True)
class SceneParts:
    """A scene as regions, and what stands in them.

    Attributes:
        regions: Their trees.
        others: Uses that are placed one by one, with their geometry.
    """

    regions: tuple[RegionTree, ...]
    others: tuple[tuple[Use, Geometry], ...]


class TreeStore:
    """Keeps the trees of a stage: a geometry's as long as the stage keeps it, and some regions'."""

    def __init__(self) -> None:
        """Makes an empty store."""
        self._trees: dict[int, TriangleTree] = {}
        self._extents: dict[int, FloatArray] = {}
        self._regions: OrderedDict[int, RegionTree] = OrderedDict()

    def parts(self, scene: Scene, cut: Set[int]) -> SceneParts:
        """The trees of the regions of a scene, and what is placed one by one.

        A region of a stage is the same in all its scenes.

        Args:
            scene: The scene.
            cut: Numbers of materials with gaps.
        """
        joined: defaultdict[int, list[tuple[Use, Geometry]]] = defaultdict(list)
        others = []
        for use in scene.uses:
            geometry = scene.geometries[use.geometry]
            count = len(geometry.triangles) * len(use.matrices)
            if not count:
                continue
            few = len(use.matrices) == 1 or count <= _JOINED
            if few and use.level is None and geometry.material not in cut:
                joined[use.region].append((use, geometry))
            else:
                others.append((use, geometry))
        regions = tuple(self._region(number, uses) for number, uses in sorted(joined.items()))
        while sum(each.tree.triangles for each in self._regions.values()) > _KEPT:
            self._regions.popitem(last=False)
        return SceneParts(regions, tuple(others))

    def tree(self, geometry: Geometry) -> TriangleTree:
        """The tree of a geometry."""
        key = id(geometry)
        if key not in self._trees:
            self._trees[key] = TriangleTree(geometry.points, geometry.triangles)
            weakref.finalize(geometry, self._trees.pop, key, None)
        return self._trees[key]

    def extent(self, geometry: Geometry) -> FloatArray:
        """2 x 3, least and largest corner of a geometry in its own space."""
        key = id(geometry)
        if key not in self._extents:
            points = geometry.points
            self._extents[key] = np.stack((points.min(axis=0), points.max(axis=0)))
            weakref.finalize(geometry, self._extents.pop, key, None)
        return self._extents[key]

    def _region(self, number: int, uses: Sequence[tuple[Use, Geometry]]) -> RegionTree:
        if number not in self._regions:
            self._regions[number] = _joined(uses)
        self._regions.move_to_end(number)
        return self._regions[number]


def _joined(uses: Sequence[tuple[Use, Geometry]]) -> RegionTree:
    """One tree of all placements, around a place in their midst."""
    middle = np.round(uses[0][0].matrices[0, :3, :3] @ uses[0][1].points[0])
    middle += np.round(uses[0][0].matrices[0, :3, 3])
    points, triangles, objects, materials, base = [], [], [], [], 0
    for use, geometry in uses:
        turned = geometry.points @ use.matrices[:, :3, :3].transpose(0, 2, 1)
        placed = turned + (use.matrices[:, None, :3, 3] - middle)
        count, vertices = placed.shape[:2]
        starts = base + vertices * np.arange(count)
        points.append(placed.reshape(-1, 3))
        triangles.append((geometry.triangles[None] + starts[:, None, None]).reshape(-1, 3))
        objects.append(np.repeat(use.scene_objects, len(geometry.triangles)))
        materials.append(np.full(count * len(geometry.triangles), geometry.material))
        base += count * vertices
    matrix = np.eye(4)
    matrix[:3, 3] = middle
    return RegionTree(
        tree=TriangleTree(np.concatenate(points), np.concatenate(triangles)),
        matrix=matrix,
        scene_objects=np.concatenate(objects),
        materials=np.concatenate(materials).astype(np.int64),
    )
