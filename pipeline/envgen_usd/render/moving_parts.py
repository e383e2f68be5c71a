"""What moves, at a moment: placed meshes and lamps, boxes, and the motion to another moment."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.render_scene import Lamps, Moment, MovingParts, Scene, Use


def placed_uses(parts: MovingParts, moment: Moment) -> Iterator[Use]:
    """Placements of the visible bodies in the world; geometries are those of the parts."""
    for use, bodies in zip(parts.uses, parts.bodies, strict=True):
        shown = moment.shown[bodies]
        if shown.any():
            matrices = moment.matrices[bodies[shown]] @ use.matrices[shown]
            yield replace(use, matrices=matrices, scene_objects=use.scene_objects[shown])


def frozen_scene(scene: Scene, moment: Moment | None) -> Scene:
    """A scene in which nothing moves: the bodies stand where they are at a moment."""
    parts = scene.moving
    if parts is None:
        return scene
    first = len(scene.geometries)
    placed = placed_uses(parts, moment or parts.start)
    return replace(
        scene,
        geometries=(*scene.geometries, *parts.geometries),
        uses=(*scene.uses, *(replace(use, geometry=use.geometry + first) for use in placed)),
        lamps=lamps_at(scene, moment),
        moving=None,
    )


def lamps_at(scene: Scene, moment: Moment | None) -> Lamps:
    """All lamps of a scene, those of visible bodies where they are."""
    parts = scene.moving
    if parts is None or not len(parts.lamp_bodies):
        return scene.lamps
    now, lamps, bodies = moment or parts.start, parts.lamps, parts.lamp_bodies
    turns, shifts = now.matrices[bodies, :3, :3], now.matrices[bodies, :3, 3]
    axes = np.einsum("nij,nj->ni", turns, lamps.axes)
    lengths = np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-12)
    placed = Lamps(
        np.einsum("nij,nj->ni", turns, lamps.places) + shifts,
        lamps.powers,
        axes / lengths,
        lamps.flat,
        lamps.edges,
    )
    lit = now.shown[bodies]
    still = vars(scene.lamps)
    return Lamps(
        **{name: np.concatenate((still[name], each[lit])) for name, each in vars(placed).items()}
    )


def body_extents(parts: MovingParts, count: int) -> FloatArray:
    """Least and largest corner of each body in its own space: K x 2 x 3; inverted without a mesh.

    Args:
        parts: What moves.
        count: Number of bodies.
    """
    extents = np.empty((count, 2, 3))
    extents[:, 0], extents[:, 1] = np.inf, -np.inf
    for use, bodies in zip(parts.uses, parts.bodies, strict=True):
        boxes = parts.geometries[use.geometry].boxes(use.matrices)
        np.minimum.at(extents[:, 0], bodies, boxes[:, 0])
        np.maximum.at(extents[:, 1], bodies, boxes[:, 1])
    return extents


def overlapping(
    extents: FloatArray, moment: Moment, frame: FloatArray, box: FloatArray
) -> IntArray:
    """Numbers of the visible bodies whose boxes overlap a box in plan and in height.

    Two rectangles overlap if they do along the axes of both (separating axes).

    Args:
        extents: K x 2 x 3, box of each body in its space.
        moment: Where the bodies are.
        frame: 4 x 4, from the space of the box to the world; its z axis is nearly upright.
        box: 2 x 3, least and largest corner.
    """
    known = np.flatnonzero(moment.shown & (extents[:, 0] <= extents[:, 1]).all(axis=1))
    matrices, low, high = moment.matrices[known], extents[known, 0], extents[known, 1]
    to_frame = np.linalg.inv(frame) @ matrices
    touched = _touch(to_frame, low, high, box[0], box[1])
    to_bodies = np.linalg.inv(matrices[touched]) @ frame
    known, low, high = known[touched], low[touched], high[touched]
    return known[_touch(to_bodies, box[0][None], box[1][None], low, high)]


def _touch(
    matrices: FloatArray, low: FloatArray, high: FloatArray, least: FloatArray, most: FloatArray
) -> BoolArray:
    """True where a box (`low` to `high`), after a transformation, reaches into another box."""
    turns = matrices[:, :3, :3]
    middles = np.einsum("nij,nj->ni", turns, (low + high) / 2.0) + matrices[:, :3, 3]
    reach = np.einsum("nij,nj->ni", np.abs(turns), (high - low) / 2.0)
    touch: BoolArray = ((middles + reach > least) & (middles - reach < most)).all(axis=1)
    return touch
