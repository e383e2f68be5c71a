"""Transitions close what lies open where linked lanes do not meet."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import shapely

from envgen_usd.chunks import snap
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.lane_borders import section_points
from envgen_usd.opendrive.links import LaneEnd, joined_ends
from envgen_usd.opendrive.names import lane_patch_id
from envgen_usd.opendrive.strips import SectionGrid, Strip

_REPORTED = 0.01
"""Lane ends further apart than this (metres) are reported."""
_TOUCHING = 0.1
"""Ends nearer than this (metres) are joined also where the file does not link them."""
_FARTHEST = 10.0
"""Ends further apart than this (metres) are not joined: the link is wrong."""
_WIDEST_STEP = 2.0
"""Lanes that differ by more than this (metres) begin or end there; no taper joins them."""
_TAPER = 10.0
"""Length of a taper over the width of the step it closes."""


class _Corners(NamedTuple):
    """End of a lane: its left and right corner seen along s, and its place in its section."""

    grid: SectionGrid
    column: int
    row: int
    points: FloatArray
    height: FloatArray


def transitions(
    network: RoadNetwork, grids: Sequence[SectionGrid]
) -> tuple[list[Strip], list[Issue]]:
    """Strips between the ends of linked lanes, and beside a lane that begins too narrow.

    Args:
        network: The roads.
        grids: Sections of one level.

    Returns:
        Strips that count only where nothing else lies, and an issue for each pair of ends that are
        more than a centimetre apart.
    """
    ends = _ends(grids)
    strips: list[Strip] = []
    issues: list[Issue] = []
    linked = _linked_pairs(network, ends)
    for one, other in sorted(linked | _touching_pairs(ends)):
        apart = _distance(ends[one], ends[other], same_way=one[1] != other[1])
        if not 0 < apart <= _FARTHEST:
            continue
        if apart > _REPORTED and (one, other) in linked:
            issues.append(_issue(one, other, apart, ends[one].grid.road.line))
        strips += _between(one, other, ends)
        for here, there in ((one, other), (other, one)):
            strips += _tapers(here, ends[here], ends[there], same_way=one[1] != other[1])
    return strips, issues


def _linked_pairs(
    network: RoadNetwork, ends: Mapping[LaneEnd, _Corners]
) -> set[tuple[LaneEnd, LaneEnd]]:
    joined = joined_ends(network)
    pairs = {(min(a, b), max(a, b)) for a in joined for b in joined[a]}
    return {(a, b) for a, b in pairs if a in ends and b in ends}


def _touching_pairs(ends: Mapping[LaneEnd, _Corners]) -> set[tuple[LaneEnd, LaneEnd]]:
    """Ends of lanes of different roads that all but meet, whether the file links them or not."""
    names = sorted(ends)
    corners = np.array([ends[name].points[:, :2] for name in names]).reshape(-1, 2, 2)
    tree = shapely.STRtree(shapely.points(corners.mean(axis=1)))
    near = tree.query(tree.geometries, predicate="dwithin", distance=_TOUCHING)
    found = set()
    for a, b in near.T.tolist():
        one, other = names[a], names[b]
        if one < other and one[0] != other[0]:
            same_way = one[1] != other[1]
            if _distance(ends[one], ends[other], same_way=same_way) < _TOUCHING:
                found.add((one, other))
    return found


def _ends(grids: Sequence[SectionGrid]) -> dict[LaneEnd, _Corners]:
    found: dict[LaneEnd, _Corners] = {}
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
                found[end] = _Corners(grid, column, row, corners, height)
    return found


def _distance(one: _Corners, other: _Corners, *, same_way: bool) -> float:
    """Distance in plan of the corners of two ends on the surface's grid."""
    there = other.points if same_way else other.points[::-1]
    return float(np.hypot(*(snap(one.points) - snap(there))[:, :2].T).max())


def _issue(one: LaneEnd, other: LaneEnd, apart: float, line: int) -> Issue:
    (road, section, lane), side = one
    (to_road, to_section, to_lane), to_side = other
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


def _between(one: LaneEnd, other: LaneEnd, ends: Mapping[LaneEnd, _Corners]) -> Iterator[Strip]:
    """One cell from the end of a lane to that of the next, both seen along the first."""
    here, there = ends[one], ends[other]
    points = np.stack([here.points, there.points if one[1] != other[1] else there.points[::-1]])
    height = np.stack([here.height, there.height if one[1] != other[1] else there.height[::-1]])
    if one[1] == "start":
        points, height = points[::-1], height[::-1]
    yield Strip(
        points[:, 0],
        points[:, 1],
        height,
        np.zeros((2, 2)),
        _patch(f"{lane_patch_id(*one[0])}_to_{lane_patch_id(*other[0])}", here.grid, here.column),
    )


def _tapers(end: LaneEnd, narrow: _Corners, wide: _Corners, *, same_way: bool) -> Iterator[Strip]:
    """Wedges beside a lane whose linked lane is wider, so that its width does not jump."""
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
