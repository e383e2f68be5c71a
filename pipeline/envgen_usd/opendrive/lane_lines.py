"""Centre lines of lanes in the direction of travel, and how traffic passes from one to another."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.models.road import Lane, LaneSection, Road, RoadLink, RoadNetwork
from envgen_usd.models.surface import LaneLine
from envgen_usd.opendrive.lane_borders import section_points
from envgen_usd.opendrive.names import lane_patch_id
from envgen_usd.opendrive.strips import SectionGrid

_Place = tuple[str, int, int]
"""A lane: road id, index of the section, lane id."""
_End = tuple[_Place, str]
"""An end of a lane: ``start`` or ``end`` along s."""


def lane_lines(network: RoadNetwork, grids: Sequence[SectionGrid]) -> tuple[LaneLine, ...]:
    """Centre lines of all lanes, linked by the file's lane links.

    Traffic on the right drives along s right of the centre lane; left-hand traffic and lanes with
    ``direction="reversed"`` the other way round.
    """
    joined = _joined_ends(network)
    lines = []
    for grid in grids:
        forward = [travels_forward(grid.road, lane) for lane in grid.borders.lanes]
        for column in range(len(grid.borders.lanes)):
            if np.diff(grid.borders.t[:, column : column + 2], axis=1).min() > -1e-3:
                continue
            lines.append(_line(network, grid, column, forward, joined))
    known = {line.id for line in lines}
    return tuple(_without_unknown(line, known) for line in lines)


def travels_forward(road: Road, lane: Lane) -> bool:
    """Whether traffic on a lane goes along s."""
    forward = (lane.id < 0) != (road.rule == "LHT")
    return forward != (lane.direction == "reversed")


def _line(
    network: RoadNetwork,
    grid: SectionGrid,
    column: int,
    forward: Sequence[bool],
    joined: Mapping[_End, Sequence[_End]],
) -> LaneLine:
    borders, lane = grid.borders, grid.borders.lanes[column]
    both = borders.t[:, column : column + 2]
    points = section_points(grid.road, grid.section, borders.s, both.mean(axis=1, keepdims=True))
    height = (borders.height_left[:, column] + borders.height_right[:, column]) / 2
    points = points[:, 0] + height[:, None] * (0.0, 0.0, 1.0)
    width = both[:, 0] - both[:, 1]
    step = 1 if forward[column] else -1
    place = (grid.road.id, grid.index, lane.id)
    entry, leave = ("start", "end")[::step]
    return LaneLine(
        id=lane_patch_id(*place),
        road=grid.road.id,
        section=grid.index,
        lane=lane.id,
        lane_type=lane.type,
        junction=grid.road.junction,
        points=points[::step],
        width=width[::step],
        speed=_speed(grid, lane),
        predecessors=_reached(network, joined, (place, entry), "end"),
        successors=_reached(network, joined, (place, leave), "start"),
        left=_beside(grid, column, column - step, forward),
        right=_beside(grid, column, column + step, forward),
    )


def _beside(grid: SectionGrid, column: int, other: int, forward: Sequence[bool]) -> str:
    if not 0 <= other < len(forward) or forward[other] != forward[column]:
        return ""
    return lane_patch_id(grid.road.id, grid.index, grid.borders.lanes[other].id)


def _speed(grid: SectionGrid, lane: Lane) -> float:
    limits = lane.speed[np.isfinite(lane.speed[:, 1]), 1]
    if len(limits):
        return float(limits[0])
    types = [entry.speed for entry in grid.road.types if entry.s <= grid.section.s]
    return types[-1] if types and np.isfinite(types[-1]) else 0.0


def _reached(
    network: RoadNetwork, joined: Mapping[_End, Sequence[_End]], end: _End, passed: str
) -> tuple[str, ...]:
    """Lanes joined to an end whose traffic enters them there (or leaves them there)."""
    found = []
    for place, side in joined.get(end, ()):
        lane = _lane_of(network, place)
        if lane is None:
            continue
        entry, leave = ("start", "end") if travels_forward(*lane) else ("end", "start")
        if side == (entry if passed == "start" else leave):
            found.append(lane_patch_id(*place))
    return tuple(sorted(set(found)))


def _lane_of(network: RoadNetwork, place: _Place) -> tuple[Road, Lane] | None:
    road = network.roads.get(place[0])
    if road is None:
        return None
    section = road.sections[place[1]]
    lanes = (*section.left, *section.right)
    return next(((road, lane) for lane in lanes if lane.id == place[2]), None)


def _joined_ends(network: RoadNetwork) -> dict[_End, list[_End]]:
    joined: dict[_End, list[_End]] = {}
    for road in network.roads.values():
        for one, other in _links_of_road(network, road):
            joined.setdefault(one, []).append(other)
            joined.setdefault(other, []).append(one)
    for one, other in _links_of_junctions(network):
        joined.setdefault(one, []).append(other)
        joined.setdefault(other, []).append(one)
    return joined


def _links_of_road(network: RoadNetwork, road: Road) -> Iterator[tuple[_End, _End]]:
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
    """Road, index of its section and end to which a road's link leads."""
    if link is None or link.element != "road" or link.id not in network.roads:
        return None
    side = link.contact_point or "start"
    return link.id, _section_at(network.roads[link.id].sections, side), side


def _section_at(sections: Sequence[LaneSection], side: str) -> int:
    return 0 if side == "start" else len(sections) - 1


def _links_of_junctions(network: RoadNetwork) -> Iterator[tuple[_End, _End]]:
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
    """Ends of the incoming road at which a connecting road begins."""
    link = connecting.predecessor if side == "start" else connecting.successor
    if link is not None and link.id == incoming.id and link.contact_point:
        return [link.contact_point]
    ends = (("start", incoming.predecessor), ("end", incoming.successor))
    return [end for end, link in ends if link is not None and link.id == junction]


def _without_unknown(line: LaneLine, known: set[str]) -> LaneLine:
    return replace(
        line,
        predecessors=tuple(name for name in line.predecessors if name in known),
        successors=tuple(name for name in line.successors if name in known),
        left=line.left if line.left in known else "",
        right=line.right if line.right in known else "",
    )
