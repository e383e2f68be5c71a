"""Centre lines of lanes in the direction of travel, with their predecessors and successors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import Lane
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.road_surface import LaneLine
from envgen_usd.opendrive.geometry.lane_borders import section_points
from envgen_usd.opendrive.geometry.section_grids import SectionGrid
from envgen_usd.opendrive.lanes.lane_changes import may_change
from envgen_usd.opendrive.lanes.lane_ends import LaneEnd, LanePlace, joined_ends
from envgen_usd.opendrive.surface_ids import lane_patch_id


def lane_lines(network: RoadNetwork, grids: Sequence[SectionGrid]) -> tuple[LaneLine, ...]:
    """Returns the centre lines of all lanes, linked by the file's lane links.

    With right-hand traffic, lanes right of the centre lane run along s. Left-hand traffic and
    ``direction="reversed"`` invert this.
    """
    joined = joined_ends(network)
    lines = []
    for grid in grids:
        forward = [travels_forward(grid.road, lane) for lane in grid.borders.lanes]
        widest = np.diff(grid.borders.t, axis=1).min(axis=0)
        middles = _middles(grid)
        for column in np.flatnonzero(widest <= -1e-3).tolist():
            lines.append(_line(network, grid, (column, middles[:, column]), forward, joined))
    known = {line.id for line in lines}
    return tuple(_without_unknown(line, known) for line in lines)


def travels_forward(road: Road, lane: Lane) -> bool:
    """Returns whether traffic on a lane follows s."""
    forward = (lane.id < 0) != (road.rule == "LHT")
    return forward != (lane.direction == "reversed")


def _middles(grid: SectionGrid) -> FloatArray:
    """Returns the centre of each lane at its height, rows x lanes x 3, metres."""
    borders = grid.borders
    between = (borders.t[:, :-1] + borders.t[:, 1:]) / 2
    points = section_points(grid.road, grid.section, borders.s, between)
    points[..., 2] += (borders.height_left + borders.height_right) / 2
    return points


def _line(
    network: RoadNetwork,
    grid: SectionGrid,
    middle: tuple[int, FloatArray],
    forward: Sequence[bool],
    joined: Mapping[LaneEnd, Sequence[LaneEnd]],
) -> LaneLine:
    column, points = middle
    lane = grid.borders.lanes[column]
    both = grid.borders.t[:, column : column + 2]
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
    lanes = grid.borders.lanes
    if not may_change(grid.section, lanes[column], lanes[other]):
        return ""
    return lane_patch_id(grid.road.id, grid.index, lanes[other].id)


def _speed(grid: SectionGrid, lane: Lane) -> float:
    """Limit at the section's start, m/s; a lane's record overrides that of the road; 0 for none."""
    types = [entry.speed for entry in grid.road.types if entry.s <= grid.section.s]
    limits = [*types[-1:], *lane.speed[:1, 1].tolist()]
    return limits[-1] if limits and np.isfinite(limits[-1]) else 0.0


def _reached(
    network: RoadNetwork, joined: Mapping[LaneEnd, Sequence[LaneEnd]], end: LaneEnd, passed: str
) -> tuple[str, ...]:
    """Returns the lanes linked to an end whose traffic enters (or leaves) there."""
    ids = []
    for place, side in joined.get(end, ()):
        lane = _lane_of(network, place)
        if lane is None:
            continue
        entry, leave = ("start", "end") if travels_forward(*lane) else ("end", "start")
        if side == (entry if passed == "start" else leave):
            ids.append(lane_patch_id(*place))
    return tuple(sorted(set(ids)))


def _lane_of(network: RoadNetwork, place: LanePlace) -> tuple[Road, Lane] | None:
    road = network.roads.get(place[0])
    if road is None:
        return None
    section = road.sections[place[1]]
    lanes = (*section.left, *section.right)
    return next(((road, lane) for lane in lanes if lane.id == place[2]), None)


def _without_unknown(line: LaneLine, known: set[str]) -> LaneLine:
    return replace(
        line,
        predecessors=tuple(name for name in line.predecessors if name in known),
        successors=tuple(name for name in line.successors if name in known),
        left=line.left if line.left in known else "",
        right=line.right if line.right in known else "",
    )
