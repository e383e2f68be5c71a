"""Placements of what moves, one after the other: where each is drawn at a moment."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.render_scene import Moment, MovingParts, Use, extent
from envgen_usd.render.stage.merged_meshes import TILE


@dataclass(frozen=True)
class PlacedMoment:
    """Where placements are drawn.

    Attributes:
        axes: P x 3 x 3, turn and scale of each.
        shifts: P x 3, metres, world.
        boxes: P x 2 x 3, minimum and maximum corner, world; not a number for what is hidden.
        places: P x 3, points whose distance decides the level of detail, world.
    """

    axes: FloatArray
    shifts: FloatArray
    boxes: FloatArray
    places: FloatArray

    @property
    def origins(self) -> FloatArray:
        """P x 3, origins of tiles that hold the placements."""
        origins = np.zeros_like(self.shifts)
        origins[:, :2] = TILE * np.floor(self.shifts[:, :2] / TILE)
        return origins


@dataclass(frozen=True)
class MovingPlacements:
    """Placements of moving parts, use by use.

    Attributes:
        parts: What moves.
        bodies: P, body of each placement.
        matrices: P x 4 x 4, to the space of the body.
        middles: P x 3, middles of the meshes.
        halves: P x 3, half their sizes.
        heads: P x 3, points that decide the level of detail, in the space of the mesh.
    """

    parts: MovingParts
    bodies: IntArray
    matrices: FloatArray
    middles: FloatArray
    halves: FloatArray
    heads: FloatArray

    def uses_at_start(self, first: int) -> tuple[Use, ...]:
        """All uses in the world at the start, also hidden ones; geometries count from `first`."""
        start = self.parts.start.matrices
        return tuple(
            replace(use, geometry=use.geometry + first, matrices=start[bodies] @ use.matrices)
            for use, bodies in zip(self.parts.uses, self.parts.bodies, strict=True)
        )

    def at(self, moment: Moment) -> PlacedMoment:
        """The placements at a moment."""
        matrices = moment.matrices[self.bodies] @ self.matrices
        axes, shifts = matrices[:, :3, :3], matrices[:, :3, 3]
        middles = np.einsum("nij,nj->ni", axes, self.middles) + shifts
        reach = np.einsum("nij,nj->ni", np.abs(axes), self.halves)
        boxes = np.stack((middles - reach, middles + reach), axis=1)
        shown: BoolArray = moment.shown[self.bodies]
        boxes[~shown] = np.nan
        places = np.einsum("nij,nj->ni", axes, self.heads) + shifts
        return PlacedMoment(axes, shifts, boxes, places)


def moving_placements(parts: MovingParts) -> MovingPlacements:
    """Lays out the placements of moving parts."""
    counts = [len(use.matrices) for use in parts.uses]
    ends = [extent(parts.geometries[use.geometry].points) for use in parts.uses]
    low, high = (np.array(each).reshape(-1, 3) for each in zip(*ends, strict=True))
    heads = np.array([use.level.middle if use.level else (0.0, 0.0, 0.0) for use in parts.uses])
    return MovingPlacements(
        parts=parts,
        bodies=np.concatenate(parts.bodies),
        matrices=np.concatenate([use.matrices for use in parts.uses]),
        middles=np.repeat((low + high) / 2.0, counts, axis=0),
        halves=np.repeat((high - low) / 2.0, counts, axis=0),
        heads=np.repeat(heads.reshape(-1, 3), counts, axis=0),
    )
