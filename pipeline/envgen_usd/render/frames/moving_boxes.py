"""Hulls, headings and velocities of moving objects."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.frames.label_images import LabelPainter
from envgen_usd.render.frames.lens_outlines import Hull, hull_of
from envgen_usd.render.render_scene import Moment, MovingParts


@dataclass(frozen=True)
class MovedObject:
    """A moving object at a moment.

    Attributes:
        parts: Convex hulls of its parts in the world, metres.
        heading: Angle of its x axis counter-clockwise from the world's, radians.
        velocity: Metres a second, of its middle.
    """

    parts: tuple[Hull, ...]
    heading: float
    velocity: tuple[float, float, float]


class MovingBoxes:
    """Finds the hulls of moving objects by their instance values."""

    def __init__(self, moving: MovingParts, painter: LabelPainter) -> None:
        """Notes the placements of each object.

        Args:
            moving: What moves.
            painter: Instance values of the scene objects.
        """
        self._moving = moving
        self._hulls: dict[int, Hull] = {}
        self._places: dict[int, list[tuple[int, int]]] = {}
        for number, use in enumerate(moving.uses):
            if use.level is not None and use.level.far:
                continue
            for row, value in enumerate(painter.values[use.scene_objects].tolist()):
                self._places.setdefault(value, []).append((number, row))

    def object_at(self, value: int, moment: Moment, beside: Moment) -> MovedObject | None:
        """A moving object; `None` for a value of what stands still.

        Args:
            value: Instance value.
            moment: Where the bodies are.
            beside: Where they are a little before or after, for the velocity.
        """
        places = [
            (number, row, int(self._moving.bodies[number][row]))
            for number, row in self._places.get(value, ())
        ]
        shown = [each for each in places if moment.shown[each[2]]]
        if not shown:
            return None
        parts = tuple(self._placed(*each, moment) for each in shown)
        first = shown[0][2]
        carrier = int(np.flatnonzero(self._moving.owners == self._moving.owners[first])[0])
        ahead = moment.matrices[carrier, :3, 0]
        speed = _velocity(parts, carrier, moment, beside)
        return MovedObject(parts, float(np.arctan2(ahead[1], ahead[0])), speed)

    def _placed(self, number: int, row: int, body: int, moment: Moment) -> Hull:
        use = self._moving.uses[number]
        if use.geometry not in self._hulls:
            self._hulls[use.geometry] = hull_of(self._moving.geometries[use.geometry])
        matrix: FloatArray = moment.matrices[body] @ use.matrices[row]
        return self._hulls[use.geometry].placed(matrix)


def _velocity(
    parts: Sequence[Hull], carrier: int, moment: Moment, beside: Moment
) -> tuple[float, float, float]:
    """Velocity of the middle of hulls, which a body carries; 0 without a time between."""
    seconds = beside.time - moment.time
    if not seconds:
        return 0.0, 0.0, 0.0
    points = np.concatenate([part.corners for part in parts])
    middle = np.append((points.min(axis=0) + points.max(axis=0)) / 2.0, 1.0)
    motion = beside.matrices[carrier] @ np.linalg.inv(moment.matrices[carrier])
    x, y, z = (((motion @ middle) - middle)[:3] / seconds).tolist()
    return x, y, z
