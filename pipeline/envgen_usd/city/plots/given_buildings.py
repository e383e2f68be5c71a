"""Buildings of the user's city model, by chunk."""

import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np
import shapely

from envgen_usd.chunks import Chunk, chunk_at
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.enclosed_plots import Enclosed
from envgen_usd.city.plots.levelled_buildings import set_down
from envgen_usd.city.plots.plausible_extent import extent_fault
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.iso19107.fault_report import city_issues
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.ground import HeightMap

_NCNAME = re.compile(r"[^\W\d][\w.\-]*")
_MARGIN = 40.0
"""Margin around a chunk in which buildings affect it, metres; a larger value includes more."""


@dataclass(frozen=True)
class Standing:
    """Given features of a chunk.

    Attributes:
        buildings: Buildings with their footprint's centroid in the chunk.
        footprints: Footprints of those in the chunk and around it.
        others: Further features in the chunk: trees, furniture, hedges, fences and walls.
        furnished: Ids of the roads that have each kind of object, of which none is generated.
        enclosed: Plots in the chunk and around it, with their houses.
        ways: Ground of the ways of a map in the chunk and around it; nothing is put there.
    """

    buildings: tuple[CityObject, ...] = ()
    footprints: tuple[shapely.Geometry, ...] = ()
    others: tuple[CityObject, ...] = ()
    furnished: Mapping[str, frozenset[str]] = field(default_factory=dict)
    enclosed: tuple[Enclosed, ...] = ()
    ways: tuple[shapely.Geometry, ...] = ()


class GivenBuildings:
    """Buildings by the chunk of their footprint's centroid.

    Attributes:
        issues: Warnings about the file.
    """

    def __init__(self, city: City) -> None:
        """Takes the buildings of a city in the road frame; other features are left out.

        Ids that are missing, duplicate or invalid in XML are replaced. Buildings with coordinates
        that no building has are left out, with an issue each.
        """
        self._by_chunk: dict[Chunk, list[_Placed]] = {}
        self._others: dict[Chunk, list[CityObject]] = {}
        self._furnished: Mapping[str, frozenset[str]] = {}
        self._enclosed: tuple[Enclosed, ...] = ()
        self._plots = self._ways = shapely.STRtree([])
        self.issues = city.issues
        names = _Names()
        buildings = [building for building in city.objects if building.kind == "Building"]
        for building in buildings:
            if fault := extent_fault(building):
                self.issues += (_left_out(building.id, fault),)
                continue
            shape = footprint_of(building)
            if not shape.is_empty:
                own = self._by_chunk.setdefault(chunk_of(shape), [])
                own.append(_Placed(names.renamed(building), shape))

    def __len__(self) -> int:
        """Number of buildings."""
        return sum(map(len, self._by_chunk.values()))

    def add(
        self,
        others: Iterable[tuple[Chunk, CityObject]],
        furnished: Mapping[str, frozenset[str]],
        issues: Iterable[Issue] = (),
    ) -> None:
        """Adds further features by chunk, and which roads have each kind of object."""
        for chunk, feature in others:
            self._others.setdefault(chunk, []).append(feature)
        self._furnished = furnished
        self.issues = (*self.issues, *issues)

    def add_plots(
        self,
        enclosed: Sequence[Enclosed],
        ways: Sequence[shapely.Geometry],
        issues: Iterable[Issue] = (),
    ) -> None:
        """Adds the plots of houses, and the ground of ways between them."""
        self._enclosed = tuple(enclosed)
        self._plots = shapely.STRtree([shapely.Polygon(each.plot.polygon) for each in enclosed])
        self._ways = shapely.STRtree(ways)
        self.issues = (*self.issues, *issues)

    def joined(self, other: "GivenBuildings") -> "GivenBuildings":
        """Returns these buildings with others, whose ids have to differ."""
        both = GivenBuildings(City((), issues=(*self.issues, *other.issues)))
        for tile, own in (*self._by_chunk.items(), *other._by_chunk.items()):
            both._by_chunk.setdefault(tile, []).extend(own)
        return both

    def buildings(self) -> tuple[CityObject, ...]:
        """All buildings, in the order of their footprints."""
        return tuple(placed.building for placed in chain(*self._by_chunk.values()))

    def footprints(self) -> tuple[shapely.Geometry, ...]:
        """Footprints of all buildings."""
        return tuple(placed.footprint for placed in chain(*self._by_chunk.values()))

    def keep(self, chunks: Iterable[Chunk]) -> None:
        """Drops the buildings outside of the given chunks."""
        wanted = set(chunks)
        self._by_chunk = {tile: own for tile, own in self._by_chunk.items() if tile in wanted}

    def check(self) -> None:
        """Adds geometry faults of the buildings to the issues."""
        self.issues = (*self.issues, *city_issues(City(self.buildings())))

    def set_down(self, heightmaps: Iterable[HeightMap], road: RoadPlan, *, each: bool) -> None:
        """Sets the buildings onto the ground, see `levelled_buildings.set_down`."""
        first, *others = heightmaps
        placed = list(chain(*self._by_chunk.values()))
        buildings = [each.building for each in placed]
        levelled = set_down(buildings, Ground(first, others).heights, road.touches, each=each)
        # Buildings move upwards or downwards, so that their footprints stay.
        lifted = iter(levelled.buildings)
        self._by_chunk = {
            tile: [_Placed(next(lifted), each.footprint) for each in own]
            for tile, own in self._by_chunk.items()
        }
        self.issues = (*self.issues, *levelled.issues)

    def around(self, chunk: Chunk) -> tuple[CityObject, ...]:
        """Returns the buildings in a chunk and in its eight neighbours."""
        return tuple(placed.building for placed in self._around(chunk))

    def standing(self, chunk: Chunk) -> Standing:
        """Returns the buildings of a chunk, and the footprints in it and around it."""
        near = shapely.box(*chunk.bounds).buffer(_MARGIN, join_style="mitre")
        around = self._around(chunk)
        touching = shapely.intersects(near, [placed.footprint for placed in around])
        plots, ways = (np.sort(tree.query(near)).tolist() for tree in (self._plots, self._ways))
        return Standing(
            tuple(placed.building for placed in self._by_chunk.get(chunk, ())),
            tuple(each.footprint for each, hit in zip(around, touching, strict=True) if hit),
            tuple(self._others.get(chunk, ())),
            self._furnished,
            tuple(self._enclosed[number] for number in plots),
            tuple(self._ways.geometries[number] for number in ways),
        )

    def _around(self, chunk: Chunk) -> list["_Placed"]:
        tiles = (chunk, *chunk.neighbours())
        return [placed for tile in tiles for placed in self._by_chunk.get(tile, ())]


@dataclass(frozen=True)
class _Placed:
    """A building with the ground that it covers."""

    building: CityObject
    footprint: shapely.Geometry


def _left_out(name: str, fault: str) -> Issue:
    where = f"Building[{name}]"
    return Issue("city.implausible", Severity.ERROR, where, fault, "the building is left out")


def chunk_of(shape: shapely.Geometry) -> Chunk:
    """Returns the chunk of a footprint's centroid."""
    return chunk_at(shapely.get_coordinates(shape.centroid)[0])


class _Names:
    """Gives each feature and surface a unique id that is an NCName."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def renamed(self, feature: CityObject) -> CityObject:
        """A feature with its parts; relations to other features are dropped."""
        name = self._name(feature.id, "building")
        surfaces = tuple(self._surface(surface, name) for surface in feature.surfaces)
        children = tuple(self.renamed(child) for child in feature.children)
        same = all(map(operator.is_, surfaces, feature.surfaces))
        same = same and all(map(operator.is_, children, feature.children))
        if name == feature.id and not feature.relations and same:
            return feature
        return replace(
            feature,
            id=name,
            surfaces=surfaces,
            relations={},
            children=children,
        )

    def _surface(self, surface: ThematicSurface, owner: str) -> ThematicSurface:
        name = self._name(surface.id, f"{owner}_surface")
        openings = tuple(self._surface(opening, name) for opening in surface.openings)
        if name == surface.id and all(map(operator.is_, openings, surface.openings)):
            return surface
        return replace(surface, id=name, openings=openings)

    def _name(self, wanted: str, instead: str) -> str:
        plain = wanted if _NCNAME.fullmatch(wanted) else ncname(f"{instead}_{wanted}")
        name, number = plain, 2
        while name in self._taken:
            name, number = f"{plain}_{number}", number + 1
        self._taken.add(name)
        return name
