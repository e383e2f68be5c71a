"""Placements of what moves, one after the other: where each is drawn at a moment."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.geometry.unique_rows import unique_rows
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.render_scene import Moment, MovingParts, Use, extent
from envgen_usd.render.stage.merged_meshes import TILE


@dataclass(frozen=True)
class PlacedMoment:
    """Where placements are drawn.

    Attributes:
        axes: P x 3 x 3, turn and scale of each.
        shifts: P x 3, metres, world.
        boxes: P x 2 x 3, minimum and maximum corner, world.
        places: P x 3, points whose distance decides the level of detail, world.
    """

    axes: FloatArray
    shifts: FloatArray
    boxes: FloatArray
    places: FloatArray


@dataclass(frozen=True)
class MovingPlacements:
    """Placements of moving parts, use by use.

    Attributes:
        parts: What moves.
        groups: P, placements of a body and a tile are a group: 0, 1, ...
        group_bodies: G, body of each group.
        extents: G x 2 x 3, least and largest corner of each group in the space of its body.
        matrices: P x 4 x 4, to the space of the body.
        middles: P x 3, middles of the meshes.
        halves: P x 3, half their sizes.
        heads: P x 3, points that decide the level of detail, in the space of the mesh.
    """

    parts: MovingParts
    groups: IntArray
    group_bodies: IntArray
    extents: FloatArray
    matrices: FloatArray
    middles: FloatArray
    halves: FloatArray
    heads: FloatArray

    @property
    def bodies(self) -> IntArray:
        """P, body of each placement."""
        bodies: IntArray = self.group_bodies[self.groups]
        return bodies

    def uses_at_start(self, first: int) -> tuple[Use, ...]:
        """All uses in the world at the start, also hidden ones; geometries count from `first`."""
        start = self.parts.start.matrices
        return tuple(
            replace(use, geometry=use.geometry + first, matrices=start[bodies] @ use.matrices)
            for use, bodies in zip(self.parts.uses, self.parts.bodies, strict=True)
        )

    def outlines(self, moment: Moment) -> FloatArray:
        """Boxes in the world that hold the groups, G x 2 x 3; not a number for what is hidden."""
        matrices = moment.matrices[self.group_bodies]
        low, high = self.extents[:, 0], self.extents[:, 1]
        outlines: FloatArray = _boxes(matrices, (low + high) / 2.0, (high - low) / 2.0)
        outlines[~moment.shown[self.group_bodies]] = np.nan
        return outlines

    def origins(self, outlines: FloatArray) -> FloatArray:
        """Origins of tiles that hold the groups, G x 3; 0 for what is hidden."""
        middles: FloatArray = np.nan_to_num(outlines.mean(axis=1))
        origins = np.zeros_like(middles)
        origins[:, :2] = TILE * np.floor(middles[:, :2] / TILE)
        return origins

    def at(self, moment: Moment, chosen: IntArray) -> PlacedMoment:
        """Chosen placements (P, their numbers) at a moment."""
        matrices = moment.matrices[self.bodies[chosen]] @ self.matrices[chosen]
        axes, shifts = matrices[:, :3, :3], matrices[:, :3, 3]
        boxes = _boxes(matrices, self.middles[chosen], self.halves[chosen])
        places = np.einsum("nij,nj->ni", axes, self.heads[chosen]) + shifts
        return PlacedMoment(axes, shifts, boxes, places)


def moving_placements(parts: MovingParts) -> MovingPlacements:
    """Lays out the placements of moving parts."""
    counts = [len(use.matrices) for use in parts.uses]
    ends = [extent(parts.geometries[use.geometry].points) for use in parts.uses]
    low, high = (np.array(each).reshape(-1, 3) for each in zip(*ends, strict=True))
    heads = np.array([use.level.middle if use.level else (0.0, 0.0, 0.0) for use in parts.uses])
    matrices = np.concatenate([use.matrices for use in parts.uses])
    middles = np.repeat((low + high) / 2.0, counts, axis=0)
    halves = np.repeat((high - low) / 2.0, counts, axis=0)
    boxes = _boxes(matrices, middles, halves)
    tiles = np.floor(boxes.mean(axis=1)[:, :2] / TILE).astype(np.int64)
    keys = np.column_stack((np.concatenate(parts.bodies), tiles))
    first, groups = unique_rows(keys)
    order = np.argsort(groups, kind="stable")
    starts = np.searchsorted(groups[order], np.arange(len(first)))
    least = np.minimum.reduceat(boxes[order, 0], starts, axis=0)
    most = np.maximum.reduceat(boxes[order, 1], starts, axis=0)
    return MovingPlacements(
        parts=parts,
        groups=groups,
        group_bodies=keys[first, 0],
        extents=np.stack((least, most), axis=1),
        matrices=matrices,
        middles=middles,
        halves=halves,
        heads=np.repeat(heads.reshape(-1, 3), counts, axis=0),
    )


def _boxes(matrices: FloatArray, middles: FloatArray, halves: FloatArray) -> FloatArray:
    """Boxes that hold boxes (middles and halves, N x 3) after a transformation: N x 2 x 3."""
    axes, shifts = matrices[:, :3, :3], matrices[:, :3, 3]
    moved = np.einsum("nij,nj->ni", axes, middles) + shifts
    reach = np.einsum("nij,nj->ni", np.abs(axes), halves)
    return np.stack((moved - reach, moved + reach), axis=1)
