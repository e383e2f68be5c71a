"""Hits of rays on what stands still and on what moves: the nearer one wins."""

from collections.abc import Set
from dataclasses import replace

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.lidar.cut_outs import CutOuts
from envgen_usd.render.lidar.static_tree import Hits, StaticTree
from envgen_usd.render.lidar.tree_store import SceneParts, TreeStore
from envgen_usd.render.moving_parts import placed_uses
from envgen_usd.render.render_scene import Floats, Moment, Scene


class MomentTree:
    """The surfaces around a sensor at a moment: a static tree, and a small one of what moves."""

    def __init__(self, still: StaticTree, moved: StaticTree) -> None:
        """Takes both trees."""
        self._still, self._moved = still, moved

    def cast(
        self,
        origins: FloatArray,
        directions: Floats,
        reach: float,
        order: IntArray | None = None,
    ) -> Hits:
        """First hits of rays; as `StaticTree.cast`."""
        hits = self._still.cast(origins, directions, reach, order)
        others = self._moved.cast(origins, directions, reach, order)
        nearer = others.ranges < hits.ranges
        chosen = {
            name: np.where(nearer, getattr(others, name), values)
            for name, values in vars(hits).items()
        }
        return Hits(**chosen)


class MovingTrees:
    """Trees of what moves on a stage; those of the meshes are built once."""

    def __init__(self, scene: Scene, reach: float, cut_outs: CutOuts) -> None:
        """Builds no tree yet.

        Args:
            scene: Scene with what moves.
            reach: Range of the sensors, metres.
            cut_outs: Those of the scene's materials.
        """
        self._scene, self._reach, self._cut_outs = scene, reach, cut_outs
        self._store = _SingleTrees()

    def beside(
        self, still: StaticTree, moment: Moment | None, eye: FloatArray
    ) -> StaticTree | MomentTree:
        """The tree of a scan.

        Args:
            still: Tree of what stands still around the sensor.
            moment: Where the bodies are; `None` if nothing moves.
            eye: 3, the sensor, world, metres.
        """
        moving = self._scene.moving
        uses = tuple(placed_uses(moving, moment)) if moving and moment else ()
        if not moving or not uses:
            return still
        scene = replace(self._scene, geometries=moving.geometries, uses=uses, moving=None)
        place = np.tile(eye[:2], (2, 1))
        return MomentTree(still, StaticTree(scene, place, self._reach, self._cut_outs, self._store))


class _SingleTrees(TreeStore):
    """Places the trees of what moves one by one, since they have other places in each scan."""

    def parts(self, scene: Scene, cut: Set[int]) -> SceneParts:
        """No regions, and all uses."""
        del cut
        return SceneParts((), tuple((use, scene.geometries[use.geometry]) for use in scene.uses))
