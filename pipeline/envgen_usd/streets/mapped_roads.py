"""The streets of a map as OpenDRIVE: the table of contents of the file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
from lxml import etree

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.rounded_lines import RoundedLine, rounded_line, thinned
from envgen_usd.models.street_plan import StreetPlan, StreetPoint
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.beside_streets import BESIDE, add_beside
from envgen_usd.streets.island_objects import add_islands
from envgen_usd.streets.island_stretches import Islands, place_of, plan_islands
from envgen_usd.streets.junction_clusters import (
    ArmEnd,
    Cluster,
    JunctionPlan,
    carriageway_half,
    plan_junctions,
)
from envgen_usd.streets.junction_turns import Ring, Turn, junction_turns
from envgen_usd.streets.mapped_furniture import Equipment
from envgen_usd.streets.mapped_road_elements import (
    junction_element,
    street_element,
    turn_element,
)
from envgen_usd.streets.street_heights import Ground, StreetHeights, street_heights
from envgen_usd.streets.street_mouths import StreetMouth, street_mouth
from envgen_usd.streets.street_sections import StreetSection, street_sections

_AWAY = 0.3
"""Distance of a point from the line by which a street is simplified, metres."""
_NEAREST = 2.0
"""Least distance of two points of a street, metres."""
_RADIUS = 9.0
"""Least radius of a bend where there is room, metres."""
_OFF_CORNER = 0.4
"""Distance of a bend from the map's corner, metres."""


@dataclass(frozen=True, eq=False)
class MappedRoads:
    """The file, and what was decided.

    Attributes:
        xml: OpenDRIVE 1.8.
        issues: Decisions beyond the map.
        counts: Numbers of roads, junctions and what they hold.
        land: Points of the map that stand beyond the roads' borders.
    """

    xml: bytes
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]
    land: tuple[StreetPoint, ...] = ()


@dataclass(frozen=True, eq=False)
class _Road:
    """A street between its junctions."""

    id: str
    number: int
    curve: RoundedLine
    sections: tuple[StreetSection, ...]
    cut: tuple[float, float]


def mapped_roads(plan: StreetPlan, name: str, ground: Ground | None = None) -> MappedRoads:
    """OpenDRIVE of the streets of a map, for traffic on the right.

    Args:
        plan: The streets.
        name: Name of the map, for the header.
        ground: Heights of the land at points, N x 2; `None` for level land.

    Raises:
        EnvgenError: No street is long enough for a road.
    """
    curves = [
        rounded_line(thinned(street.line, _AWAY, _NEAREST), _RADIUS, _OFF_CORNER)
        for street in plan.streets
    ]
    junctions = plan_junctions(plan, curves)
    plan, junctions, islands = plan_islands(plan, curves, junctions)
    heights = street_heights(plan, curves, junctions, ground)
    return _Writer(plan, curves, junctions, heights, islands).written(name)


class _Writer:
    """Writes roads and junctions in the order of the map."""

    def __init__(
        self,
        plan: StreetPlan,
        curves: Sequence[RoundedLine],
        junctions: JunctionPlan,
        heights: StreetHeights,
        islands: Islands,
    ) -> None:
        self._plan, self._curves, self._heights = plan, curves, heights
        self._junctions, self._islands = junctions, islands
        joined = {
            arm
            for cluster in junctions.clusters
            if len(cluster.arms) + len(cluster.inner) > 1
            for arm in cluster.arms
        }
        ids = map(str, count(1))
        self._roads = {
            n: self._road(next(ids), n, cut, joined)
            for n, cut in enumerate(junctions.cuts)
            if cut is not None
        }
        self._ids = ids

    def _road(self, name: str, n: int, cut: tuple[float, float], joined: set[ArmEnd]) -> _Road:
        ends = ArmEnd(n, True) in joined, ArmEnd(n, False) in joined
        sections = street_sections(self._plan.streets[n], self._curves[n], cut, ends)
        return _Road(name, n, self._curves[n].part(*cut), sections, cut)

    def written(self, name: str) -> MappedRoads:
        """The file."""
        if not self._roads:
            raise EnvgenError(f"{self._plan.source}: none of its streets is long enough for a road")
        root = etree.Element("OpenDRIVE")
        header = etree.SubElement(
            root, "header", revMajor="1", revMinor="8", name=name, version="1.0",
        )  # fmt: skip
        etree.SubElement(header, "geoReference").text = etree.CDATA(self._plan.crs)
        equipment = Equipment(self._plan, self._curves, self._junctions)
        streets = {n: self._street(road) for n, road in self._roads.items()}
        turns, junctions, missing = self._written_junctions(equipment, streets)
        places = self._places()
        for n, road in self._roads.items():
            own = places.get(n, ())
            equipment.add_crossings(road.cut, road.sections, (n, streets[n]), own)
            equipment.counts["islands"] += add_islands(streets[n], road.sections, own)
        lost = add_beside(
            [point for point in self._plan.points if point.kind in BESIDE | {"sign"}],
            [(road.curve, road.sections, streets[n]) for n, road in self._roads.items()],
        )
        root.extend([*streets.values(), *turns, *junctions])
        counts = {
            **self._plan.counts,
            "roads": len(streets),
            "connecting": len(turns),
            "junctions": len(junctions),
            **equipment.counts,
            **lost.placed,
        }
        xml = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
        issues = (
            *self._issues(missing),
            *self._islands.issues(self._plan.source),
            *lost.issues(self._plan),
        )
        return MappedRoads(xml, issues, counts, lost.land)

    def _written_junctions(
        self, equipment: Equipment, streets: Mapping[int, etree._Element]
    ) -> tuple[list[etree._Element], list[etree._Element], int]:
        """Connecting roads, junctions, and how many streets lead into one and not out of it."""
        turns, junctions, missing = [], [], 0
        for cluster in self._junctions.clusters:
            if len(cluster.arms) + len(cluster.inner) < 2:
                continue
            mouths = self._mouths(cluster)
            equipment.equip(cluster, mouths, streets)
            number = next(self._ids)
            ways = list(self._turns(cluster, mouths))
            roads = [(next(self._ids), turn) for turn in ways]
            missing += sum(
                bool(m.entering) and not any(t.incoming is m and t.lanes for t in ways)
                for m in mouths
            )
            if roads:
                self._link(cluster, number, streets)
                turns += [self._turn(road, number, turn) for road, turn in roads]
                junctions.append(junction_element(number, roads))
        return turns, junctions, missing

    def _places(self) -> dict[int, list[tuple[float, float]]]:
        """S of the middle and length of the islands on the road of each street, metres."""
        found: dict[int, list[tuple[float, float]]] = {}
        for island in self._islands.built:
            place, cut = place_of(island, self._junctions), self._junctions.cuts[island.street]
            if place is not None and cut is not None:
                found.setdefault(island.street, []).append((place[0] - cut[0], place[1]))
        return found

    def _street(self, road: _Road) -> etree._Element:
        street = self._plan.streets[road.number]
        elevation = self._heights.pieces(road.number, *road.cut)
        return street_element(road.id, street, road.curve, road.sections, elevation)

    def _mouths(self, cluster: Cluster) -> list[StreetMouth]:
        """Street ends of a junction, counter-clockwise around the middle of its nodes."""
        middle = self._plan.nodes[list(cluster.nodes)].mean(0)
        mouths = []
        for arm in cluster.arms:
            road = self._roads[arm.street]
            height, slope = self._heights.at(arm.street, road.cut[0 if arm.at_start else 1])
            outwards = slope if arm.at_start else -slope
            mouths.append(street_mouth(arm, road.id, road.curve, road.sections, (height, outwards)))
        return sorted(mouths, key=lambda m: float(np.arctan2(*(m.place - middle)[::-1])))

    def _turns(self, cluster: Cluster, mouths: Sequence[StreetMouth]) -> Iterator[Turn]:
        ring = None
        if cluster.ring:
            points = np.concatenate([self._plan.streets[n].line[:-1] for n in cluster.ring])
            centre = points.mean(0)
            radius = float(np.linalg.norm(points - centre, axis=1).mean())
            widths = [
                2.0 * carriageway_half(p)
                for n in cluster.ring
                for p in self._plan.streets[n].profiles
            ]
            ring = Ring(centre, radius, max(widths))
        yield from junction_turns(mouths, ring, frozenset(self._banned(cluster, mouths)))

    def _banned(self, cluster: Cluster, mouths: Sequence[StreetMouth]) -> Iterator[tuple[int, int]]:
        """Turns that restrictions of the map exclude, by the numbers of mouths."""
        ways = [self._way(mouth.arm) for mouth in mouths]
        nodes = set(cluster.nodes)
        here = {(first, last) for first, node, last in self._plan.banned if node in nodes}
        for n, first in enumerate(ways):
            for m, last in enumerate(ways):
                if (first, last) in here and n != m:
                    yield n, m

    def _way(self, arm: ArmEnd) -> int:
        ways = self._plan.streets[arm.street].ways
        return ways[0 if arm.at_start else -1]

    def _link(self, cluster: Cluster, number: str, streets: Mapping[int, etree._Element]) -> None:
        for arm in cluster.arms:
            end = "predecessor" if arm.at_start else "successor"
            elements.add_link(streets[arm.street], end, "junction", number)

    def _turn(self, road: str, junction: str, turn: Turn) -> etree._Element:
        """A connecting road that goes over from height and slope of one street to the other's."""
        (a, down), (b, up) = turn.incoming.height, turn.outgoing.height
        length, out, into = turn.length, -down, up
        square = (3 * (b - a) / length - 2 * out - into) / length
        cube = (out + into - 2 * (b - a) / length) / length**2
        return turn_element(road, junction, turn, [(0.0, a, out, square, cube)])

    def _issues(self, missing: int) -> Iterator[Issue]:
        where, short = self._plan.source, self._junctions.short
        yield from self._plan.issues
        if short:
            text = f"{len(short)} streets are too short for a road beside their junctions"
            way = f"{where}: way {self._plan.streets[short[0]].ways[0]}"
            yield Issue("streets.short", Severity.INFO, way, text, "left out")
        if missing:
            text = f"{missing} street ends have no way on through their junction"
            yield Issue("streets.no_turn", Severity.INFO, where, text, "they end there")
