"""Lane ends that the file links (1.8.1, 8.2, 11.5 and 12.4)."""

import math
from collections.abc import Iterator, Sequence
from typing import TypeAlias

from envgen_usd.models.lanes import LaneSection
from envgen_usd.models.road import Road, RoadLink, RoadNetwork

LanePlace: TypeAlias = tuple[str, int, int]
"""A lane: road id, index of the lane section, lane id."""
LaneEnd: TypeAlias = tuple[LanePlace, str]
"""A lane end: ``start`` or ``end`` along s."""


def joined_ends(network: RoadNetwork) -> dict[LaneEnd, list[LaneEnd]]:
    """Returns linked lane ends in both directions.

    Links come from lanes within a road, from linked roads, and from connections of junctions.
    """
    joined: dict[LaneEnd, list[LaneEnd]] = {}
    for road in network.roads.values():
        for first, second in _links_of_road(network, road):
            joined.setdefault(first, []).append(second)
            joined.setdefault(second, []).append(first)
    for first, second in _links_of_junctions(network):
        joined.setdefault(first, []).append(second)
        joined.setdefault(second, []).append(first)
    return joined


def _links_of_road(network: RoadNetwork, road: Road) -> Iterator[tuple[LaneEnd, LaneEnd]]:
    last = len(road.sections) - 1
    for index, section in enumerate(road.sections):
        for lane in (*section.left, *section.right):
            place = (road.id, index, lane.id)
            for other in lane.successors:
                if index < last:
                    yield (place, "end"), ((road.id, index + 1, other), "start")
                elif (end := _linked_end(network, road.successor)) is not None:
                    yield (place, "end"), ((end[0], end[1], other), end[2])
            for other in lane.predecessors:
                if index > 0:
                    yield (place, "start"), ((road.id, index - 1, other), "end")
                elif (end := _linked_end(network, road.predecessor)) is not None:
                    yield (place, "start"), ((end[0], end[1], other), end[2])


def _linked_end(network: RoadNetwork, link: RoadLink | None) -> tuple[str, int, str] | None:
    """Returns road, section index and end that a road link leads to; `None` for other targets."""
    if link is None or link.element != "road" or link.id not in network.roads:
        return None
    if math.isfinite(link.s):
        # A position along a road is not an end of it; see `junction_sites`.
        return None
    side = link.contact_point or "start"
    return link.id, _section_at(network.roads[link.id].sections, side), side


def _section_at(sections: Sequence[LaneSection], side: str) -> int:
    return 0 if side == "start" else len(sections) - 1


def _links_of_junctions(network: RoadNetwork) -> Iterator[tuple[LaneEnd, LaneEnd]]:
    for junction in network.junctions.values():
        for connection in junction.connections:
            incoming = network.roads.get(connection.incoming_road)
            connecting = network.roads.get(connection.connecting_road)
            if incoming is None or connecting is None:
                continue
            side = connection.contact_point or "start"
            into = _section_at(connecting.sections, side)
            for leaving in _ends_at(incoming, junction.id, connecting, side):
                outof = _section_at(incoming.sections, leaving)
                for lane, other in connection.lane_links:
                    yield (
                        ((incoming.id, outof, lane), leaving),
                        ((connecting.id, into, other), side),
                    )


def _ends_at(incoming: Road, junction: str, connecting: Road, side: str) -> list[str]:
    """Returns the ends of the incoming road at which a connecting road starts."""
    link = connecting.predecessor if side == "start" else connecting.successor
    if link is not None and link.id == incoming.id and link.contact_point:
        return [link.contact_point]
    ends = (("start", incoming.predecessor), ("end", incoming.successor))
    return [end for end, link in ends if link is not None and link.id == junction]
