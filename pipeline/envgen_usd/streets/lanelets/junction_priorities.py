"""Which connecting roads give way to which: `right_of_way` of a Lanelet2 map."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import product

from lxml import etree

from envgen_usd.models.lanelet_map import LaneletMap
from envgen_usd.streets.lanelets.lanelet_road_elements import LaneletRoad
from envgen_usd.streets.lanelets.road_strips import LaneEnd, RoadPlan


class JunctionPriorities:
    """Pairs of connecting roads of which the first has priority over the second."""

    def __init__(self, plan: RoadPlan, roads: Sequence[LaneletRoad], source: LaneletMap) -> None:
        """Finds the pairs of all junctions."""
        self._plan, self._roads = plan, roads
        strips_of: dict[int, list[int]] = defaultdict(list)
        for n, strip in enumerate(plan.strips):
            for lanelet in {n for group in strip.groups for n in group.lanelets}:
                strips_of[lanelet].append(n)
        self._pairs: dict[int, dict[tuple[int, int], None]] = defaultdict(dict)
        for rule in source.regulations.values():
            if rule.subtype != "right_of_way":
                continue
            high, low = (
                {
                    way
                    for lanelet in rule.lanelets.get(role, ())
                    for n in strips_of.get(lanelet, ())
                    for way in self._ways(n, lanelet)
                }
                for role in ("right_of_way", "yield")
            )
            for first, second in product(sorted(high - low), sorted(low - high)):
                junction = plan.strips[first].junction
                if junction == plan.strips[second].junction:
                    self._pairs[junction][first, second] = None

    def _ways(self, n: int, lanelet: int) -> Iterator[int]:
        """Connecting roads that a lanelet is a part of, or that go on from it."""
        strip = self._plan.strips[n]
        if strip.junction >= 0:
            yield n
            return
        lane = strip.groups[0].lanelets.index(lanelet)
        for end in (0, 1):
            for there in self._plan.onward.get(LaneEnd(n, end, lane), ()):
                if self._plan.strips[there.strip].junction >= 0:
                    yield there.strip

    def write(self, junction: etree._Element, number: int) -> None:
        """Adds the pairs of a junction (OpenDRIVE 1.8.1, 12.8)."""
        for high, low in self._pairs.get(number, ()):
            pair = {"high": self._roads[high].id, "low": self._roads[low].id}
            etree.SubElement(junction, "priority", pair)
