"""Faces of a building in its own frame: x along the street, y into the plot, z from the floor."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

Point: TypeAlias = tuple[float, float, float]
Ring: TypeAlias = list[Point]


@dataclass
class Opening:
    """A window or a door that fills a hole of a face.

    Attributes:
        kind: ``WindowSurface`` or ``DoorSurface``.
        ring: Counter-clockwise seen from outside, the lower left corner first.
    """

    kind: str
    ring: Ring


@dataclass
class Face:
    """A planar face of a closed shell.

    Attributes:
        kind: CityGML class, e.g. ``RoofSurface``.
        part: What it is, e.g. ``slope``, ``fascia``, ``parapet``; it decides the material.
        ring: Exterior, counter-clockwise seen from outside.
        holes: Clockwise seen from outside; those of the openings are not among them.
        openings: Fill holes of their own.
    """

    kind: str
    part: str
    ring: Ring
    holes: list[Ring] = field(default_factory=list)
    openings: list[Opening] = field(default_factory=list)


Frame: TypeAlias = Callable[[float, float, float], Point]


def straight(x: float, y: float, z: float) -> Point:
    """The frame of a block whose ridge runs along the street."""
    return x, y, z


def turned(width: float) -> Frame:
    """Returns the frame of a block whose ridge runs away from the street.

    Args:
        width: Of the building along the street; the block's x runs along its right side.
    """

    def place(x: float, y: float, z: float) -> Point:
        return width - y, x, z

    return place


def ring(frame: Frame, points: Sequence[Point]) -> Ring:
    """Points of a block in the building's frame."""
    return [frame(*point) for point in points]


def reversed_ring(points: Sequence[Point]) -> Ring:
    """The same ring seen from the other side."""
    return list(reversed(points))
