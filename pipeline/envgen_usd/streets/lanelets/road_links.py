"""Links of roads and lanes, and the junctions of a map of lanelets."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

from lxml import etree

from envgen_usd.models.lanelet_map import LaneletMap
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.lanelets.junction_priorities import JunctionPriorities
from envgen_usd.streets.lanelets.lanelet_road_elements import LaneletRoad
from envgen_usd.streets.lanelets.road_seams import lane_ends
from envgen_usd.streets.lanelets.road_strips import LaneEnd, RoadPlan

_CONTACT = ("start", "end")
_NAMES = ("predecessor", "successor")


class RoadLinks:
    """Writes links into the elements of roads."""

    def __init__(
        self,
        plan: RoadPlan,
        roads: Sequence[LaneletRoad],
        junction_ids: Mapping[int, str],
        source: LaneletMap,
        free_id: Iterator[str],
    ) -> None:
        """Prepares links.

        Args:
            plan: The roads.
            roads: The same roads with their elements.
            junction_ids: Number of a junction to its id.
            source: The map.
            free_id: Ids of further junctions.
        """
        self._plan, self._roads, self._source = plan, roads, source
        self._junction_ids, self._free_id = junction_ids, free_id
        self.junctions: list[etree._Element] = []
        self.crossing_junctions = 0

    def write(self) -> None:
        """Links all roads and lanes, and makes the junctions."""
        direct = self._direct()
        priorities = JunctionPriorities(self._plan, self._roads, self._source)
        for n in range(len(self._roads)):
            for end in (0, 1):
                self._link_road(n, end, direct)
            self._link_sections(n)
        for number, id_ in self._junction_ids.items():
            junction = self._junction(number, id_)
            priorities.write(junction, number)
            self.junctions.append(junction)
        for ends, id_ in _seams(direct).items():
            self.junctions.append(self._direct_junction(ends, id_))

    def _partners(self, n: int, end: int) -> list[tuple[int, int]]:
        """Road ends that the lanes of a road end lead to."""
        ways = lane_ends(self._plan, n, end)
        found = {(each.strip, each.end): None for way in ways for each in way}
        return list(found)

    def _direct(self) -> dict[tuple[int, int], str]:
        """Ends of roads outside of junctions that meet several of these, to a junction's id."""
        graph: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for n, strip in enumerate(self._plan.strips):
            for end in (0, 1):
                if strip.junction < 0:
                    partners = self._partners(n, end)
                    graph[n, end] = [p for p in partners if self._plan.strips[p[0]].junction < 0]
        found: dict[tuple[int, int], str] = {}
        for key, others in graph.items():
            if key in found or len(others) < 2 or self._enters_junction(*key):
                continue
            id_, stack = next(self._free_id), [key]
            while stack:
                here = stack.pop()
                if here not in found:
                    found[here] = id_
                    stack += graph.get(here, [])
        return found

    def _enters_junction(self, n: int, end: int) -> bool:
        return any(self._plan.strips[p[0]].junction >= 0 for p in self._partners(n, end))

    def _link_road(self, n: int, end: int, direct: Mapping[tuple[int, int], str]) -> None:
        element, strip = self._roads[n].element, self._plan.strips[n]
        partners = self._partners(n, end)
        if not partners:
            return
        crossing = [p for p in partners if self._plan.strips[p[0]].junction >= 0]
        if strip.junction < 0 and crossing:
            number = self._plan.strips[crossing[0][0]].junction
            elements.add_link(element, _NAMES[end], "junction", self._junction_ids[number])
            return
        if (n, end) in direct:
            elements.add_link(element, _NAMES[end], "junction", direct[n, end])
            return
        outside = [p for p in partners if self._plan.strips[p[0]].junction < 0]
        other, contact = (outside or partners)[0]
        self.crossing_junctions += strip.junction >= 0 and not outside
        elements.add_link(element, _NAMES[end], "road", self._roads[other].id, _CONTACT[contact])
        for lane, ways in enumerate(lane_ends(self._plan, n, end)):
            ids = [self._lane_id(way) for way in ways if (way.strip, way.end) == (other, contact)]
            if ids:
                self._link_lane(n, end, self._lane_id(LaneEnd(n, end, lane)), ids[0])

    def _lane_id(self, end: LaneEnd) -> int:
        return self._plan.strips[end.strip].groups[-end.end].lane_id(end.lane)

    def _link_lane(
        self, n: int, end: int, lane: int, other: int, section: int | None = None
    ) -> None:
        sections = self._roads[n].element.findall("lanes/laneSection")
        holder = sections[-end if section is None else section]
        found = holder.find(f"*/lane[@id='{lane}']")
        assert found is not None
        link = found.find("link")
        if link is None:
            link = etree.Element("link")
            found.insert(0, link)
        etree.SubElement(link, _NAMES[end], id=str(other))

    def _link_sections(self, n: int) -> None:
        """Links equal lanes of the sections of a road."""
        groups = self._plan.strips[n].groups
        for section in range(len(groups)):
            for lane in range(len(groups[section].lanelets)):
                id_ = groups[section].lane_id(lane)
                if section > 0:
                    self._link_lane(n, 0, id_, id_, section)
                if section + 1 < len(groups):
                    self._link_lane(n, 1, id_, id_, section)

    def _enters(self, n: int, end: int, lane: int) -> bool:
        """Whether traffic enters a lane of a road at an end."""
        group = self._plan.strips[n].groups[-end]
        lanelet = self._source.lanelets[group.lanelets[lane]]
        return not lanelet.one_way or group.along[lane] != bool(end)

    def _junction(self, number: int, id_: str) -> etree._Element:
        junction = etree.Element("junction", id=id_, name=f"junction {id_}", type="default")
        for n, strip in enumerate(self._plan.strips):
            if strip.junction != number:
                continue
            for end in (0, 1):
                self._connect(junction, n, end)
        return junction

    def _connect(self, junction: etree._Element, n: int, end: int) -> None:
        """Adds the connections from the roads whose traffic enters a connecting road at an end."""
        links: dict[int, list[tuple[int, int]]] = defaultdict(list)
        for lane, ways in enumerate(lane_ends(self._plan, n, end)):
            if not self._enters(n, end, lane):
                continue
            for way in ways:
                if self._plan.strips[way.strip].junction < 0:
                    pair = self._lane_id(way), self._lane_id(LaneEnd(n, end, lane))
                    links[way.strip].append(pair)
        for other, pairs in links.items():
            connection = etree.SubElement(
                junction, "connection", id=str(len(junction)), incomingRoad=self._roads[other].id,
                connectingRoad=self._roads[n].id, contactPoint=_CONTACT[end],
            )  # fmt: skip
            for first, into in sorted(set(pairs)):
                etree.SubElement(connection, "laneLink", {"from": str(first), "to": str(into)})

    def _direct_junction(self, ends: Sequence[tuple[int, int]], id_: str) -> etree._Element:
        junction = etree.Element("junction", id=id_, name=f"junction {id_}", type="direct")
        for n, end in ends:
            links: dict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
            for lane, ways in enumerate(lane_ends(self._plan, n, end)):
                for way in ways:
                    if self._enters(way.strip, way.end, way.lane):
                        pair = self._lane_id(LaneEnd(n, end, lane)), self._lane_id(way)
                        links[way.strip, way.end].append(pair)
            for (other, contact), pairs in links.items():
                connection = etree.SubElement(
                    junction, "connection", id=str(len(junction)),
                    incomingRoad=self._roads[n].id, linkedRoad=self._roads[other].id,
                    contactPoint=_CONTACT[contact],
                )  # fmt: skip
                for first, into in pairs:
                    etree.SubElement(connection, "laneLink", {"from": str(first), "to": str(into)})
        return junction


def _seams(direct: Mapping[tuple[int, int], str]) -> dict[tuple[tuple[int, int], ...], str]:
    """Road ends of each direct junction to its id."""
    found: dict[str, list[tuple[int, int]]] = defaultdict(list)
    for key, id_ in direct.items():
        found[id_].append(key)
    return {tuple(keys): id_ for id_, keys in found.items()}
