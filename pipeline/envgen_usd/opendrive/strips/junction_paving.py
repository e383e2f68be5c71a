"""Paves lanes of type ``none`` in junctions if they continue a paved lane.

Files close gaps between connecting roads with such lanes, where a median or turning lane ends at
the junction. The standard leaves their surface open (1.8.1, 11.7).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import Lane
from envgen_usd.opendrive.geometry.section_grids import SectionGrid
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.surface_ids import lane_patch_id

_NEAR = 0.5
"""Largest distance in metres between the centres of lane ends that meet."""
_UNPAVED = frozenset(("none", "median", "sidewalk", "walking", "curb"))
_KEPT = frozenset(("shoulder", "border", "parking", "restricted", "stop"))


def pave_junctions(
    grids: Sequence[SectionGrid], strips: Sequence[Strip]
) -> tuple[list[Strip], list[Issue]]:
    """Gives strips of such lanes the type of the adjoining lane; a traffic lane gives ``shoulder``.

    Args:
        grids: Lane sections of a level.
        strips: Strips of their lanes.

    Returns:
        All strips, and an issue for each junction with paved lanes.
    """
    paved = dict(_paved(grids))
    if not paved:
        return list(strips), []
    typed = [
        replace(strip, patch=replace(strip.patch, lane_type=paved[strip.patch.id]))
        if strip.patch.id in paved
        else strip
        for strip in strips
    ]
    return typed, list(_issues(grids, paved))


def _paved(grids: Sequence[SectionGrid]) -> Iterator[tuple[str, str]]:
    """Yields the patch ids of paved lanes with their new types.

    A lane through several sections is judged as a whole by all lanes that its ends meet outside
    the junction: one of them unpaved leaves it unpaved.
    """
    inner = [grid for grid in grids if grid.road.junction]
    waiting = [
        (lane_patch_id(grid.road.id, grid.index, lane.id), middle)
        for grid in inner
        for lane, middle in _ends(grid)
        if lane.type == "none"
    ]
    outside = [end for grid in grids if not grid.road.junction for end in _ends(grid)]
    if not waiting or not outside:
        return
    tree = shapely.STRtree(shapely.points([middle for _, middle in outside]))
    where = shapely.points([middle for _, middle in waiting])
    whole = _whole_lanes(inner)
    types: dict[int, set[str]] = {}
    for end, other in tree.query(where, predicate="dwithin", distance=_NEAR).T.tolist():
        types.setdefault(whole[waiting[end][0]], set()).add(outside[other][0].type)
    for name in sorted({name for name, _ in waiting}):
        met = types.get(whole[name], set())
        if met and not met & _UNPAVED:
            kept = sorted(met & _KEPT)
            yield name, kept[0] if kept else "shoulder"


def _whole_lanes(grids: Sequence[SectionGrid]) -> dict[str, int]:
    """Returns the number of the whole lane that each part of type ``none`` belongs to.

    Files leave such lanes without links, so a part continues in the next section of its road
    where the centres of their ends meet.
    """
    ends: dict[tuple[str, int, int], list[tuple[str, FloatArray]]] = {}
    for grid in grids:
        for row in (0, -1):
            ends[grid.road.id, grid.index, row] = [
                (lane_patch_id(grid.road.id, grid.index, lane.id), middle)
                for lane, middle in _ends_at(grid, row)
                if lane.type == "none"
            ]
    names = list(dict.fromkeys(name for part in ends.values() for name, _ in part))
    number = {name: index for index, name in enumerate(names)}
    joints = [
        (number[name], number[following])
        for (road, section, row), part in ends.items()
        if row == -1
        for name, end in part
        for following, start in ends.get((road, section + 1, 0), ())
        if np.hypot(*(start - end)) <= _NEAR
    ]
    before = list(range(len(names)))
    for part, following in joints:
        before[_first(before, following)] = _first(before, part)
    return {name: _first(before, index) for name, index in number.items()}


def _first(before: Sequence[int], part: int) -> int:
    """Returns the first part of a whole lane; `before` leads there, and from there to itself."""
    while before[part] != part:
        part = before[part]
    return part


def _ends(grid: SectionGrid) -> Iterator[tuple[Lane, FloatArray]]:
    """Yields each lane with a width, and its centre (x, y), at both ends."""
    for row in (0, -1):
        yield from _ends_at(grid, row)


def _ends_at(grid: SectionGrid, row: int) -> Iterator[tuple[Lane, FloatArray]]:
    sides = grid.points[row, :, :2]
    wide = np.hypot(*np.diff(sides, axis=0).T) > _NEAR
    for column in np.flatnonzero(wide).tolist():
        yield grid.borders.lanes[column], sides[column : column + 2].mean(axis=0)


def _issues(grids: Sequence[SectionGrid], paved: Mapping[str, str]) -> Iterator[Issue]:
    counts: dict[str, int] = {}
    for grid in grids:
        for lane in grid.borders.lanes:
            if lane_patch_id(grid.road.id, grid.index, lane.id) in paved:
                counts[grid.road.junction] = counts.get(grid.road.junction, 0) + 1
    for junction, count in counts.items():
        yield Issue(
            "junction.unpaved_lane",
            Severity.INFO,
            f"junction[id={junction}]",
            f"{count} lanes of type none continue paved lanes",
            "paved",
        )
