"""Converts faces of a building to thematic surfaces in the road frame."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import accumulate, chain, pairwise

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.city.buildings.building_faces import Face, Opening, Ring
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.city_model import ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

_NAMES = {
    "WallSurface": "wall",
    "RoofSurface": "roof",
    "GroundSurface": "ground",
    "OuterCeilingSurface": "soffit",
    "OuterFloorSurface": "floor",
    "InteriorWallSurface": "wall",
    "FloorSurface": "floor",
    "CeilingSurface": "ceiling",
    "WindowSurface": "window",
    "DoorSurface": "door",
}


@dataclass(frozen=True)
class Site:
    """Position and ground heights of a building.

    Attributes:
        origin: 2, left end of its street side as seen from the street, metres, road frame.
        along: 2, unit vector along that side, to the right as seen from the street.
        lowest: Lowest ground under the footprint, metres.
        highest: Highest ground under the footprint, metres.
        street: Height of the ground before the street side, metres; `highest` if unknown.
        room: Free depth before the street side, metres.
    """

    origin: FloatArray
    along: FloatArray
    lowest: float
    highest: float
    street: float | None = None
    room: float = 3.0

    def place(self, points: FloatArray, floor: float) -> FloatArray:
        """Converts points of the building's frame, N x 3, to the road frame on `chunks.GRID`."""
        ax, ay = self.along.tolist()
        world = np.empty_like(points)
        world[:, 0] = self.origin[0] + points[:, 0] * ax - points[:, 1] * ay
        world[:, 1] = self.origin[1] + points[:, 0] * ay + points[:, 1] * ax
        world[:, 2] = points[:, 2] + floor
        return snap(world)


@dataclass
class SurfaceMaker:
    """Builds the surfaces of a building.

    Attributes:
        name: Prefix of their ids.
        site: Position of the building.
        floor: Height of its floor, metres, road frame.
        lod: Level of detail of the surfaces.
        material: Function of the CityGML class and the part.
        embrasure: Distance of openings behind the wall's surface, metres.
    """

    name: str
    site: Site
    floor: float
    lod: int
    material: Callable[[str, str], str]
    embrasure: float = 0.0
    _counts: dict[str, int] = field(default_factory=dict)

    def surfaces(self, faces: Sequence[Face]) -> tuple[ThematicSurface, ...]:
        """Returns a surface for each face, and one for the reveals of its embrasures."""
        groups = [list(self._groups(face)) for face in faces]
        rings = [list(chain(*group)) for group in chain(*groups)]
        points = self.site.place(np.array(list(chain(*rings))), self.floor)
        ends = list(accumulate(map(len, rings), initial=0))
        pieces = (points[start:end] for start, end in pairwise(ends))
        surfaces = [
            self._surface(face, group, pieces) for face, group in zip(faces, groups, strict=True)
        ]
        return tuple(chain(*surfaces))

    def polygons(self, rings: Sequence[Ring]) -> Polygons:
        """A polygon in the road frame for each ring of the building's frame."""
        points = self.site.place(np.array(list(chain(*rings))), self.floor)
        return Polygons(
            points,
            np.array(list(accumulate(map(len, rings), initial=0)), dtype=np.int64),
            np.arange(len(rings) + 1, dtype=np.int64),
        )

    def _groups(self, face: Face) -> Iterator[list[Ring]]:
        """Rings of the face, of each opening, and of the reveals of all openings."""
        yield [face.ring, *face.holes, *(opening.ring[::-1] for opening in face.openings)]
        reveals: list[Ring] = []
        for opening in face.openings:
            if self._recessed(face):
                inner = _behind(opening, self.embrasure)
                yield [inner]
                reveals += _reveal(opening.ring, inner)
            else:
                yield [opening.ring]
        if reveals:
            yield reveals

    def _recessed(self, face: Face) -> bool:
        return self.embrasure > 0.0 and face.kind == "WallSurface"

    def _surface(
        self, face: Face, group: list[list[Ring]], pieces: Iterator[FloatArray]
    ) -> Iterator[ThematicSurface]:
        sizes = tuple(len(ring) for ring in group[0])
        polygon = Polygons(next(pieces), *_one_polygon(sizes))
        panes = [Polygons(next(pieces), *_one_polygon((4,))) for _ in face.openings]
        openings = (
            self._thematic(opening.kind, opening.kind, pane)
            for opening, pane in zip(face.openings, panes, strict=True)
        )
        yield self._thematic(face.kind, face.part, polygon, tuple(openings))
        if face.openings and self._recessed(face):
            count = 4 * len(face.openings)
            sides = Polygons(next(pieces), *_quads(count))
            yield self._thematic("WallSurface", "reveal", sides)

    def _thematic(
        self,
        kind: str,
        part: str,
        polygons: Polygons,
        openings: tuple[ThematicSurface, ...] = (),
    ) -> ThematicSurface:
        short = _NAMES[kind]
        self._counts[short] = number = self._counts.get(short, 0) + 1
        return ThematicSurface(
            id=f"{self.name}_{short}_{number}",
            kind=kind,
            polygons=polygons,
            lod=self.lod,
            material=self.material(kind, part),
            attributes={} if part == kind else {"part": part},
            openings=openings,
        )


@cache
def _one_polygon(sizes: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    return np.cumsum((0, *sizes), dtype=np.int64), np.array([0, len(sizes)], dtype=np.int64)


@cache
def _quads(count: int) -> tuple[IntArray, IntArray]:
    return np.arange(0, 4 * count + 1, 4, dtype=np.int64), np.arange(count + 1, dtype=np.int64)


def _behind(opening: Opening, depth: float) -> Ring:
    """The opening's ring, moved into the vertical wall."""
    (x0, y0, _), (x1, y1, _) = opening.ring[:2]
    length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    # Inwards is to the left of the lower edge, which runs to the right as seen from outside.
    dx, dy = -(y1 - y0) / length * depth, (x1 - x0) / length * depth
    return [(x + dx, y + dy, z) for x, y, z in opening.ring]


def _reveal(outer: Ring, inner: Ring) -> list[Ring]:
    """Sides of the hole between the wall and the recessed opening."""
    return [[outer[a], outer[(a + 1) % 4], inner[(a + 1) % 4], inner[a]] for a in range(4)]
