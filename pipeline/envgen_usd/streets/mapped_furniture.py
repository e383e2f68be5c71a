"""Crossings, stop lines, signals, signs and arrows of mapped streets."""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from lxml import etree

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.street_plan import StreetPlan, StreetPoint
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.junction_clusters import Cluster, JunctionPlan
from envgen_usd.streets.street_mouths import StreetMouth
from envgen_usd.streets.street_sections import StreetSection, value_of

_AT_JUNCTION = 30.0
"""Distance of a signal from the end of a street whose junction it controls, metres."""
_ON_STREET = 1.0
"""Farthest point from the line of its street, metres."""
_CROSSWALK = 2.5
"""Distance of a crossing's middle from the junction, metres."""
_ISLAND = 5.0
"""Distance up to which a crossing moves to the island of its node, metres."""
_STOP = 1.0
"""Distance of a stop line from the junction without a crossing, metres."""
_POST = 0.5
"""Distance of a sign from the kerb, metres."""
_ARROW = (6.0, 1.2, 12.0)
"""Length and width of an arrow, and its distance from the stop line, metres."""
_ARROWS: Mapping[frozenset[str], str] = {
    frozenset({"left"}): "arrowLeft",
    frozenset({"right"}): "arrowRight",
    frozenset({"through"}): "arrowStraight",
    frozenset({"left", "through"}): "arrowStraightLeft",
    frozenset({"right", "through"}): "arrowStraightRight",
    frozenset({"left", "right"}): "arrowLeftRight",
    frozenset({"left", "right", "through"}): "arrowStraightLeftRight",
}
PRIORITY_SIGN = "signal"
"""Begin of the ids of signs and traffic lights that tell who waits."""
_SIGNS = {"stop": "206", "give_way": "205"}
_MAIN_RANK = 3
"""Rank from which a street has priority over lower ones where the map says nothing."""


class Equipment:
    """What lies on streets and stands beside them, sorted by street.

    Attributes:
        counts: Numbers of what was added.
    """

    def __init__(
        self, plan: StreetPlan, curves: Sequence[RoundedLine], junctions: JunctionPlan
    ) -> None:
        """Finds the street of each point of the map."""
        self._plan, self._junctions = plan, junctions
        self.counts: Counter[str] = Counter()
        self._at: dict[int, list[tuple[float, StreetPoint]]] = {}
        lines = [
            shapely.LineString(c(np.linspace(0.0, c.length, max(int(c.length / 2), 2)))[0])
            for c in curves
        ]
        tree = shapely.STRtree(lines)
        for point in plan.points:
            place = shapely.Point(point.place)
            for n in tree.query(place, predicate="dwithin", distance=_ON_STREET).tolist():
                s = shapely.line_locate_point(lines[n], place) * curves[n].length / lines[n].length
                self._at.setdefault(n, []).append((float(s), point))

    def equip(
        self, cluster: Cluster, mouths: Sequence[StreetMouth], streets: Mapping[int, etree._Element]
    ) -> None:
        """Adds signals, signs and arrows to the streets that lead into a junction."""
        signalled = self._has_signals(cluster, mouths)
        ranks = [mouth.section.profile.rank for mouth in mouths]
        main = sum(rank >= _MAIN_RANK for rank in ranks) > 1 and not cluster.ring
        for mouth, rank in zip(mouths, ranks, strict=True):
            if not mouth.entering or mouth.section.length < 4.0 * _STOP:
                continue
            road = streets[mouth.arm.street]
            stop = self._stop(mouth)
            kind = self._sign(mouth)
            if signalled:
                kind = "1000001"
            elif not kind and len(mouths) > 2:
                lower = main and rank < max(ranks) and rank < _MAIN_RANK + 2
                kind = "205" if lower or (cluster.ring and len(cluster.ring) > 1) else ""
            if kind:
                self._add_signal(road, mouth, kind, stop)
            if kind in {"1000001", "206"}:
                self._add_stop_line(road, mouth, stop)
            self._add_arrows(road, mouth, stop)

    def _near(self, mouth: StreetMouth, reach: float) -> list[StreetPoint]:
        """Points of a street within its junction or up to a distance from it."""
        street = mouth.arm.street
        cut = self._junctions.cuts[street]
        assert cut is not None
        return [
            point
            for s, point in self._at.get(street, ())
            if (s < cut[0] + reach if mouth.arm.at_start else s > cut[1] - reach)
        ]

    def _has_signals(self, cluster: Cluster, mouths: Sequence[StreetMouth]) -> bool:
        inner = [p for n in cluster.inner for _, p in self._at.get(n, ())]
        near = [p for mouth in mouths if mouth.entering for p in self._near(mouth, _AT_JUNCTION)]
        return len(mouths) > 1 and any(p.kind == "signals" for p in (*inner, *near))

    def _sign(self, mouth: StreetMouth) -> str:
        """Number of the sign that the map has at the end of a street."""
        towards = -1 if mouth.arm.at_start else 1
        for point in self._near(mouth, 15.0):
            if point.kind in _SIGNS and point.along in {0, towards}:
                return _SIGNS[point.kind]
        return ""

    def _crossing(self, mouth: StreetMouth) -> StreetPoint | None:
        """The crossing at the end of a street, where there is one."""
        points = self._near(mouth, 2.0 * _CROSSWALK)
        found = [point for point in points if point.kind in {"zebra", "crossing"}]
        return found[0] if found else None

    def _stop(self, mouth: StreetMouth) -> float:
        """Distance of the stop line from the end of a street, metres."""
        return 2.0 * _CROSSWALK if self._crossing(mouth) is not None else _STOP

    def _s(self, mouth: StreetMouth, distance: float) -> float:
        """S at a distance from the end of a street."""
        section = mouth.section
        return distance if mouth.arm.at_start else section.start + section.length - distance

    def _borders(self, mouth: StreetMouth) -> tuple[float, float]:
        """T of the left end of the entering lanes as traffic sees it, and of the kerb."""
        inward = np.array([np.cos(mouth.heading_in), np.sin(mouth.heading_in)])
        right = np.array([inward[1], -inward[0]])
        # Distances from the middle of the carriageway.
        inner = float((mouth.entering[0].inner - mouth.place) @ right)
        kerb = float((mouth.kerbs[0] - mouth.place) @ right)
        sign = 1.0 if mouth.arm.at_start else -1.0
        return sign * inner + mouth.t, sign * kerb + mouth.t

    def _add_signal(self, road: etree._Element, mouth: StreetMouth, kind: str, stop: float) -> None:
        _, kerb = self._borders(mouth)
        t = kerb + np.copysign(_POST, kerb - mouth.t)
        end = "start" if mouth.arm.at_start else "end"
        name = f"{PRIORITY_SIGN}_{road.get('id')}_{end}"
        orientation = "-" if mouth.arm.at_start else "+"
        s = self._s(mouth, stop + 0.5)
        elements.add_signal(holder(road, "signals"), name, kind, s, t, orientation)
        self.counts["signals" if kind == "1000001" else "signs"] += 1

    def _add_stop_line(self, road: etree._Element, mouth: StreetMouth, stop: float) -> None:
        inner, kerb = self._borders(mouth)
        end = "start" if mouth.arm.at_start else "end"
        elements.add_painted_line(
            holder(road, "objects"),
            f"stop_{road.get('id')}_{end}",
            "stop line",
            self._s(mouth, stop + 0.25),
            (inner, kerb),
        )
        self.counts["stop_lines"] += 1

    def _add_arrows(self, road: etree._Element, mouth: StreetMouth, stop: float) -> None:
        """An arrow on each lane whose directions the map names."""
        length, width, away = _ARROW
        inward = np.array([np.cos(mouth.heading_in), np.sin(mouth.heading_in)])
        right = np.array([inward[1], -inward[0]])
        end = "start" if mouth.arm.at_start else "end"
        sign = 1.0 if mouth.arm.at_start else -1.0
        for lane in mouth.entering:
            kind = _ARROWS.get(lane.turns)
            if kind is None:
                continue
            middle = (lane.inner + lane.outer) / 2.0 - mouth.place
            for n, distance in enumerate((stop + away, stop + away + 25.0)):
                if distance + length / 2.0 > mouth.section.length - 5.0:
                    break
                elements.add_arrow(
                    holder(road, "objects"),
                    f"arrow_{road.get('id')}_{end}_{lane.number}_{n}",
                    kind,
                    (self._s(mouth, distance), sign * float(middle @ right) + mouth.t),
                    np.pi if mouth.arm.at_start else 0.0,
                    (length, width),
                )
                self.counts["arrows"] += 1

    def add_crossings(
        self,
        cut: tuple[float, float],
        sections: Sequence[StreetSection],
        of: tuple[int, etree._Element],
        islands: Sequence[tuple[float, float]],
    ) -> None:
        """Adds the zebra crossings of a street; those in a junction lie before it.

        Args:
            cut: Distances along the street between which it is a road, metres.
            sections: Its lane sections.
            of: Number of the street, and its road.
            islands: s of the middle and length of its islands; crossings lead through them.
        """
        street, road = of
        length = cut[1] - cut[0]
        placed: list[float] = []
        for s, point in self._at.get(street, ()):
            if point.kind != "zebra" or length < 3.0 * _CROSSWALK:
                continue
            at = min(max(s - cut[0], _CROSSWALK), length - _CROSSWALK)
            at = min((x for x, _ in islands if abs(x - at) < _ISLAND), default=at)
            if any(abs(at - other) < 5.0 for other in placed):
                continue
            placed.append(at)
            section = next(x for x in reversed(sections) if x.start <= at)
            sides = [
                sum(
                    value_of(lane.width, at - section.start)
                    for lane in lanes
                    if lane.lane.kind != "sidewalk" and not lane.lane.raised
                )
                for lanes in (section.left, section.right)
            ]
            offset = value_of(section.offset, at - section.start)
            elements.add_crosswalk(
                holder(road, "objects"),
                f"crosswalk_{road.get('id')}_{len(placed)}",
                at,
                sides[0] + offset,
                sides[1] - offset,
            )
            self.counts["crosswalks"] += 1


def holder(road: etree._Element, name: str) -> etree._Element:
    """The element with objects or signals of a road, in the order of the standard."""
    found = road.find(name)
    if found is not None:
        return found
    holder = etree.Element(name)
    signals = road.find("signals")
    if name == "objects" and signals is not None:
        signals.addprevious(holder)
    else:
        road.append(holder)
    return holder
