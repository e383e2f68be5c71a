"""Faces of a building in its frame: x along the street, y into the plot, z from the floor."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

Point: TypeAlias = tuple[float, float, float]
Ring: TypeAlias = list[Point]
Frame: TypeAlias = Callable[[float, float, float], Point]


@dataclass
class Opening:
    """A window or a door in a hole of a face.

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
        part: Part of the building, e.g. ``slope``, ``fascia``, ``parapet``; it decides the
            material.
        ring: Exterior, counter-clockwise seen from outside.
        holes: Clockwise seen from outside, without the holes of the openings.
        openings: Windows and doors, each in a separate hole.
    """

    kind: str
    part: str
    ring: Ring
    holes: list[Ring] = field(default_factory=list)
    openings: list[Opening] = field(default_factory=list)

    def moved(self, frame: Frame) -> "Face":
        """The face, transformed to the enclosing frame."""
        return Face(
            self.kind,
            self.part,
            [frame(*point) for point in self.ring],
            [[frame(*point) for point in hole] for hole in self.holes],
            [Opening(o.kind, [frame(*point) for point in o.ring]) for o in self.openings],
        )


def placed(x: float, y: float, width: float, turned: bool) -> Frame:
    """Returns the frame of a block.

    Args:
        x: x of the block's left front corner in the building's frame, metres.
        y: y of that corner, metres.
        width: Width of the block along the building's x, metres.
        turned: True if the block's ridge runs along the building's y; the block's x then runs along
            its right side.
    """
    if turned:
        return lambda u, v, z: (x + width - v, y + u, z)
    return lambda u, v, z: (x + u, y + v, z)


def box(low: Point, high: Point, kind: str, part: str) -> list[Face]:
    """Six faces of a box: bottom and sides of the given class, the top a roof."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    a, b, c, d = (x0, y0), (x1, y0), (x1, y1), (x0, y1)
    sides = [
        Face(kind, part, [(*p, z0), (*q, z0), (*q, z1), (*p, z1)])
        for p, q in ((a, b), (b, c), (c, d), (d, a))
    ]
    bottom = Face(kind, part, [(*p, z0) for p in (a, d, c, b)])
    return [*sides, bottom, Face("RoofSurface", part, [(*p, z1) for p in (a, b, c, d)])]
