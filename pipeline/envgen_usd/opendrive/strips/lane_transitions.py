"""Transitions close gaps between linked lane ends."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.geometry.lane_borders import section_points
from envgen_usd.opendrive.geometry.section_grids import SectionGrid
from envgen_usd.opendrive.lanes.lane_ends import LaneEnd, joined_ends
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.surface_ids import lane_patch_id

_REPORTED = 0.01
"""Least gap between linked lane ends in metres that is reported."""
_TOUCHING = 0.1
"""Gap in metres below which lane ends are joined without a link."""
_FARTHEST = 10.0
"""Largest gap in metres that is closed; beyond it the link is considered wrong."""
_WIDEST_STEP = 2.0
"""Largest step of width in metres with a taper; beyond it a lane starts or ends there."""
_TAPER = 10.0
"""Length of a taper per metre of width step; a larger value gives a flatter taper."""


class _Corners(NamedTuple):
    """End of a lane: left and right corner seen along s, and its row in its section."""

    grid: SectionGrid
    column: int
    row: int
    points: FloatArray
    height: FloatArray


def transitions(
    network: RoadNetwork, grids: Sequence[SectionGrid]
) -> tuple[list[Strip], list[Issue]]:
    """Returns strips between linked lane ends, and beside lanes that start too narrow.

    Args:
        network: The road network.
        grids: Lane sections of a level.

    Returns:
        Strips with the lowest precedence, and an issue for each pair of linked ends more than
        `_REPORTED` apart.
    """
    ends = _ends(grids)
    strips: list[Strip] = []
    issues: list[Issue] = []
    linked = _linked_pairs(network, ends)
    for first, second in sorted(linked | _touching_pairs(ends)):
        apart = _distance(ends[first], ends[second], same_way=first[1] != second[1])
        if not 0 < apart <= _FARTHEST:
            continue
        if apart > _REPORTED and (first, second) in linked:
            issues.append(_issue(first, second, apart, ends[first].grid.road.line))
        strips += _between(first, second, ends)
        for here, there in ((first, second), (second, first)):
            strips += _tapers(here, ends[here], ends[there], same_way=first[1] != second[1])
    return strips, issues


def _linked_pairs(
    network: RoadNetwork, ends: Mapping[LaneEnd, _Corners]
) -> set[tuple[LaneEnd, LaneEnd]]:
    joined = joined_ends(network)
    pairs = {(min(a, b), max(a, b)) for a in joined for b in joined[a]}
    return {(a, b) for a, b in pairs if a in ends and b in ends}


def _touching_pairs(ends: Mapping[LaneEnd, _Corners]) -> set[tuple[LaneEnd, LaneEnd]]:
    """Returns lane ends of different roads that touch, linked or not."""
    names = sorted(ends)
    corners = np.array([ends[name].points[:, :2] for name in names]).reshape(-1, 2, 2)
    tree = shapely.STRtree(shapely.points(corners.mean(axis=1)))
    near = tree.query(tree.geometries, predicate="dwithin", distance=_TOUCHING)
    pairs = set()
    for a, b in near.T.tolist():
        first, second = names[a], names[b]
        if first < second and first[0] != second[0]:
            same_way = first[1] != second[1]
            if _distance(ends[first], ends[second], same_way=same_way) < _TOUCHING:
                pairs.add((first, second))
    return pairs


def _ends(grids: Sequence[SectionGrid]) -> dict[LaneEnd, _Corners]:
    corners_of: dict[LaneEnd, _Corners] = {}
    for grid in grids:
        borders, section = grid.borders, grid.section
        sides = []
        if borders.s[0] <= section.s + 1e-6:
            sides.append(("start", 0))
        if borders.s[-1] >= section.end - 1e-6:
            sides.append(("end", len(borders.s) - 1))
        for side, row in sides:
            for column, lane in enumerate(borders.lanes):
                height = np.array(
                    [borders.height_left[row, column], borders.height_right[row, column]]
                )
                corners = grid.points[row, column : column + 2]
                end = ((grid.road.id, grid.index, lane.id), side)
                corners_of[end] = _Corners(grid, column, row, corners, height)
    return corners_of


def _distance(first: _Corners, second: _Corners, *, same_way: bool) -> float:
    """Returns the largest distance in plan between the snapped corners of two ends, metres."""
    there = second.points if same_way else second.points[::-1]
    return float(np.hypot(*(snap(first.points) - snap(there))[:, :2].T).max())


def _issue(first: LaneEnd, second: LaneEnd, apart: float, line: int) -> Issue:
    (road, section, lane), side = first
    (to_road, to_section, to_lane), to_side = second
    return Issue(
        "lane.gap",
        Severity.WARNING,
        f"road[id={road}]/lanes/laneSection[{section + 1}]/lane[id={lane}]",
        f"its {side} lies {apart:.3f} m from the {to_side} of the linked lane {to_lane} in section "
        f"{to_section + 1} of road {to_road}",
        "closed by a transition",
        line,
    )


def _patch(name: str, grid: SectionGrid, column: int) -> Patch:
    lane = grid.borders.lanes[column]
    return Patch(
        id=f"transition_{name}",
        kind="transition",
        lane_type=lane.type,
        road=grid.road.id,
        section=grid.index,
        lane=lane.id,
        junction=grid.road.junction,
        material=lane.material,
    )


def _between(first: LaneEnd, second: LaneEnd, ends: Mapping[LaneEnd, _Corners]) -> Iterator[Strip]:
    """Yields a cell between two lane ends, both seen along the first."""
    here, there = ends[first], ends[second]
    points = np.stack([here.points, there.points if first[1] != second[1] else there.points[::-1]])
    height = np.stack([here.height, there.height if first[1] != second[1] else there.height[::-1]])
    if first[1] == "start":
        points, height = points[::-1], height[::-1]
    yield Strip(
        points[:, 0],
        points[:, 1],
        height,
        np.zeros((2, 2)),
        _patch(
            f"{lane_patch_id(*first[0])}_to_{lane_patch_id(*second[0])}", here.grid, here.column
        ),
    )


def _tapers(end: LaneEnd, narrow: _Corners, wide: _Corners, *, same_way: bool) -> Iterator[Strip]:
    """Yields wedges beside a lane with a wider linked lane; they avoid a jump of the width."""
    grid = narrow.grid
    across = narrow.points[0, :2] - narrow.points[1, :2]
    across /= max(float(np.hypot(*across)), 1e-9)
    there = wide.points if same_way else wide.points[::-1]
    steps = (there - narrow.points)[:, :2] @ across
    for side, sign in ((0, 1.0), (1, -1.0)):
        step = float(sign * steps[side])
        length = min(_TAPER * step, (grid.borders.s[-1] - grid.borders.s[0]) / 2)
        if not _REPORTED < step <= _WIDEST_STEP or length <= 0:
            continue
        yield _taper(end, narrow, side, sign * step, length)


def _taper(end: LaneEnd, narrow: _Corners, side: int, step: float, length: float) -> Strip:
    grid, place = narrow.grid, narrow.column + side
    s = grid.borders.s
    tip = s[narrow.row] + (length if narrow.row == 0 else -length)
    low, high = sorted((float(tip), float(s[narrow.row])))
    rows = np.array([low, *s[(s > low + 1e-3) & (s < high - 1e-3)], high])
    border = np.interp(rows, s, grid.borders.t[:, place])
    moved = border + step * (1 - np.abs(rows - s[narrow.row]) / length)
    t = np.column_stack([moved, border] if step > 0 else [border, moved])
    points = section_points(grid.road, grid.section, rows, t)
    heights = grid.borders.height_left if side == 0 else grid.borders.height_right
    height = np.interp(rows, s, heights[:, narrow.column])
    return Strip(
        points[:, 0],
        points[:, 1],
        np.column_stack([height, height]),
        np.zeros((len(rows), 2)),
        _patch(f"{lane_patch_id(*end[0])}_{end[1]}", grid, narrow.column),
    )
