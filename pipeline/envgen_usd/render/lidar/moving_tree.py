"""Hits of rays on what stands still and on what moves: the nearer one wins."""

from dataclasses import replace

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.lidar.cut_outs import CutOuts
from envgen_usd.render.lidar.static_tree import Hits, StaticTree
from envgen_usd.render.lidar.tree_store import TreeStore
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


def tree_at(
    still: StaticTree,
    scene: Scene,
    moment: Moment | None,
    eye: FloatArray,
    reach: float,
    cut_outs: CutOuts,
    store: TreeStore,
) -> StaticTree | MomentTree:
    """The tree of a scan.

    Args:
        still: Tree of what stands still around the sensor.
        scene: The scene with what moves.
        moment: Where the bodies are; `None` if nothing moves.
        eye: 3, the sensor, world, metres.
        reach: Range of the sensor, metres.
        cut_outs: Those of the scene's materials.
        store: Trees of the geometries of what moves.
    """
    if scene.moving is None or moment is None:
        return still
    uses = tuple(placed_uses(scene.moving, moment))
    if not uses:
        return still
    bodies = replace(scene, geometries=scene.moving.geometries, uses=uses, moving=None)
    place = np.tile(eye[:2], (2, 1))
    return MomentTree(still, StaticTree(bodies, place, reach, cut_outs, store, joined=False))
