"""Junctions with their roads and ways, beyond the area of the roads (chapter 12)."""

import math
from collections.abc import Iterator

import numpy as np

from envgen_usd.models.junctions import Connection, Junction
from envgen_usd.models.lanes import DRIVEN, Lane
from envgen_usd.models.road import Road, RoadLink, RoadNetwork
from envgen_usd.models.road_surface import JunctionSite
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.lanes.lane_lines import travels_forward
from envgen_usd.opendrive.surface_ids import lane_patch_id

_Lanes = list[tuple[str, Lane, bool]]
"""Ids of the lanes of a section, the lanes, and whether their traffic follows s."""


def junction_sites(network: RoadNetwork) -> tuple[JunctionSite, ...]:
    """Returns the junctions of all types with the roads that meet there.

    ``ways`` are the lanes that a virtual junction connects with positions along its main road. The
    lane links name them. Otherwise they are the outermost lanes of both roads with traffic in the
    directions of the connection (12.6).
    """
    return tuple(_site(network, junction) for junction in network.junctions.values())


def _site(network: RoadNetwork, junction: Junction) -> JunctionSite:
    ways = [*_ways_of_links(network, junction), *_ways_of_connections(network, junction)]
    met = [road for each in junction.connections for road in _roads(network, each)]
    stretches = tuple(_stretches(network, junction))
    roads = [*(road for road, _, _ in stretches), *met]
    return JunctionSite(
        id=junction.id,
        name=junction.name,
        type=junction.type,
        main_road=junction.main_road,
        s_start=junction.s_start,
        s_end=junction.s_end,
        orientation=junction.orientation,
        roads=tuple(dict.fromkeys(road for road in roads if road in network.roads)),
        stretches=stretches,
        ways=tuple(dict.fromkeys(ways)),
    )


def _roads(network: RoadNetwork, connection: Connection) -> Iterator[str]:
    """Yields the roads that a connection names, except roads inside the junction."""
    named = [connection.incoming_road, connection.connecting_road]
    named += [each.attributes.get("elementId", "") for each in connection.extra]
    for name in named:
        road = network.roads.get(name)
        if road is not None and not road.junction:
            yield name


def _stretches(network: RoadNetwork, junction: Junction) -> Iterator[tuple[str, float, float]]:
    """Yields road stretches in the junction; for a junction without area, those leading to it."""
    if junction.main_road in network.roads:
        yield junction.main_road, junction.s_start, junction.s_end
    for record in junction.extra:
        name = record.attributes.get("roadId", "")
        if record.tag == "roadSection" and name in network.roads:
            start, end = (read(record.attributes.get(key, "")) for key in ("sStart", "sEnd"))
            yield name, start or 0.0, end or 0.0
    for road in network.roads.values():
        for link, s in ((road.predecessor, 0.0), (road.successor, road.length)):
            if link is not None and link.element == "junction" and link.id == junction.id:
                yield road.id, s, s


def _ways_of_links(network: RoadNetwork, junction: Junction) -> Iterator[tuple[str, str]]:
    """Yields ways of connecting roads that start or end along another road."""
    for road in network.roads.values():
        if road.junction != junction.id:
            continue
        for link, s in ((road.predecessor, 0.0), (road.successor, road.length)):
            if link is None or not _is_along(network, link):
                continue
            there = {lane.id: name for name, lane, _ in _lanes_at(network.roads[link.id], link.s)}
            for name, lane, forward in _lanes_at(road, s):
                for other in lane.predecessors if s == 0.0 else lane.successors:
                    if other in there:
                        enters = forward == (s == 0.0)
                        yield (there[other], name) if enters else (name, there[other])


def _is_along(network: RoadNetwork, link: RoadLink) -> bool:
    return link.element == "road" and math.isfinite(link.s) and link.id in network.roads


def _ways_of_connections(network: RoadNetwork, junction: Junction) -> Iterator[tuple[str, str]]:
    """Yields ways of connections from a position along a road to another position or road."""
    for connection in junction.connections:
        ends = [_end(network, connection, tag) for tag in ("predecessor", "successor")]
        if not all(ends):
            continue
        before, after = ends
        if connection.lane_links:
            names = [{lane.id: name for name, lane, _ in end} for end in ends]
            for start, goal in connection.lane_links:
                if start in names[0] and goal in names[1]:
                    yield names[0][start], names[1][goal]
        else:
            yield from ((one[0], other[0]) for one, other in zip(before, after, strict=False))


def _end(network: RoadNetwork, connection: Connection, tag: str) -> _Lanes:
    """Returns the lanes at an end of a connection in its direction, outermost first."""
    for record in connection.extra:
        road = network.roads.get(record.attributes.get("elementId", ""))
        if record.tag == tag and road is not None and "elementS" in record.attributes:
            along = record.attributes.get("elementDir", "+") == "+"
            return _driven(road, read(record.attributes["elementS"]) or 0.0, along=along)
    road = network.roads.get(connection.connecting_road) if tag == "successor" else None
    if road is None:
        return []
    at_start = connection.contact_point != "end"
    return _driven(road, 0.0 if at_start else road.length, along=at_start)


def _driven(road: Road, s: float, *, along: bool) -> _Lanes:
    driven = [each for each in _lanes_at(road, s) if each[1].type in DRIVEN and each[2] == along]
    return sorted(driven, key=lambda each: -abs(each[1].id))


def _lanes_at(road: Road, s: float) -> _Lanes:
    starts = np.array([section.s for section in road.sections])
    index = max(int(np.searchsorted(starts, s, side="right")) - 1, 0)
    return [
        (lane_patch_id(road.id, index, lane.id), lane, travels_forward(road, lane))
        for section in road.sections[index : index + 1]
        for lane in (*section.left, *section.right)
    ]
