"""Buildings that another city model gives, by the chunk they stand in."""

import re
from collections.abc import Iterable
from dataclasses import replace
from itertools import chain

import shapely

from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.names import ncname
from envgen_usd.geometry.iso19107.report import city_issues
from envgen_usd.models.city import City, CityObject, ThematicSurface

_NCNAME = re.compile(r"[^\W\d][\w.\-]*")


class GivenBuildings:
    """Buildings by the chunk in which the middle of their footprint lies.

    Attributes:
        issues: What was odd in the file.
    """

    def __init__(self, city: City) -> None:
        """Takes the buildings of a city in the frame of the road; others are left out.

        Ids that XML does not allow, that are missing, or that occur twice are replaced.
        """
        self._by_chunk: dict[Chunk, list[CityObject]] = {}
        self.issues = city.issues
        names = _Names()
        for building in city.objects:
            shape = footprint_of(building) if building.kind == "Building" else shapely.Point()
            if not shape.is_empty:
                self._by_chunk.setdefault(chunk_of(shape), []).append(names.renamed(building))

    def __len__(self) -> int:
        """Number of buildings."""
        return sum(map(len, self._by_chunk.values()))

    def keep(self, chunks: Iterable[Chunk]) -> None:
        """Forgets the buildings outside of some chunks."""
        wanted = set(chunks)
        self._by_chunk = {tile: own for tile, own in self._by_chunk.items() if tile in wanted}

    def check(self) -> None:
        """Adds what is wrong with the geometry of the buildings to the issues."""
        kept = tuple(chain.from_iterable(self._by_chunk.values()))
        self.issues = (*self.issues, *city_issues(City(kept)))

    def around(self, chunk: Chunk) -> tuple[CityObject, ...]:
        """Returns the buildings in a chunk and in the eight around it."""
        tiles = (chunk, *chunk.neighbours())
        return tuple(found for tile in tiles for found in self._by_chunk.get(tile, ()))


def chunk_of(shape: shapely.Geometry) -> Chunk:
    """Returns the chunk in which the middle of a footprint lies."""
    centre = shape.centroid
    return Chunk(int(centre.x // CHUNK_SIZE), int(centre.y // CHUNK_SIZE))


class _Names:
    """Gives each feature and surface an id that is an NCName and unique."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def renamed(self, thing: CityObject) -> CityObject:
        """A feature with its parts; relations to others are not kept."""
        name = self._name(thing.id, "building")
        return replace(
            thing,
            id=name,
            surfaces=tuple(self._surface(surface, name) for surface in thing.surfaces),
            relations={},
            children=tuple(self.renamed(child) for child in thing.children),
        )

    def _surface(self, surface: ThematicSurface, owner: str) -> ThematicSurface:
        name = self._name(surface.id, f"{owner}_surface")
        openings = tuple(self._surface(opening, name) for opening in surface.openings)
        return replace(surface, id=name, openings=openings)

    def _name(self, wanted: str, instead: str) -> str:
        plain = wanted if _NCNAME.fullmatch(wanted) else ncname(f"{instead}_{wanted}")
        name, number = plain, 2
        while name in self._taken:
            name, number = f"{plain}_{number}", number + 1
        self._taken.add(name)
        return name
