"""Lane sections, evaluated at rows that follow the road's curvature."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.built_lanes import built_lanes
from envgen_usd.opendrive.geometry.lane_borders import (
    LaneBorders,
    lane_borders,
    section_points,
    stacked_points,
)
from envgen_usd.opendrive.geometry.row_sampling import stacked_rows
from envgen_usd.opendrive.geometry.section_stack import SectionStack

_AT_ONCE = 1000
"""Sections that are evaluated at once; a larger value takes more memory."""
_BEFORE_END = 1e-7
"""Metres before its end at which a section is evaluated instead of at the end."""
_LAND = frozenset(("none", "border"))


@dataclass(frozen=True)
class SectionGrid:
    """A lane section of a road, evaluated at N rows.

    Attributes:
        road: The road.
        index: Index of the section.
        section: The section.
        borders: Lane borders at the rows.
        points: N x (L + 1) x 3, metres, road frame, the borders without lane heights.
    """

    road: Road
    index: int
    section: LaneSection
    borders: LaneBorders
    points: FloatArray


def section_grids(roads: Iterable[Road], tolerance: float) -> list[SectionGrid]:
    """Evaluates all sections of roads, each at rows that follow its curvature.

    Sections with equal numbers of lanes are evaluated at once.

    Args:
        roads: The roads.
        tolerance: Largest chord error in metres; a larger value gives fewer rows.

    Returns:
        The sections, road by road.
    """
    places = [
        (road, index, section)
        for road in roads
        for index, section in enumerate(road.sections)
        if section.end - section.s >= 1e-3
    ]
    alike: dict[tuple[int, int], list[int]] = {}
    for number, (_, _, section) in enumerate(places):
        alike.setdefault((len(section.left), len(section.right)), []).append(number)
    grids: dict[int, SectionGrid] = {}
    for numbers in alike.values():
        for k in range(0, len(numbers), _AT_ONCE):
            members = numbers[k : k + _AT_ONCE]
            grids.update(zip(members, _grids([places[m] for m in members], tolerance), strict=True))
    return [grids[number] for number in range(len(places))]


def part_of_grid(grid: SectionGrid, start: float, end: float) -> SectionGrid:
    """Returns the part of a section between two s, with rows at both."""
    rows = grid.borders.s
    if start <= rows[0] and end >= rows[-1]:
        return grid
    between = rows[(rows > start + 1e-3) & (rows < end - 1e-3)]
    return _grid(grid.road, grid.index, np.array([start, *between, end]))


def _grid(road: Road, index: int, rows: FloatArray) -> SectionGrid:
    section = road.sections[index]
    inside = inside_section(section, rows)
    borders = lane_borders(road, section, inside)
    points = section_points(road, section, inside, borders.t)
    return SectionGrid(road, index, section, borders, points)


def _grids(places: Sequence[tuple[Road, int, LaneSection]], tolerance: float) -> list[SectionGrid]:
    """Evaluates sections with equal numbers of lanes."""
    stack = SectionStack([(road, section) for road, _, section in places])
    owner, rows = stacked_rows(stack, tolerance)
    inside = np.clip(rows, stack.start[owner], stack.end[owner] - _BEFORE_END)
    t = stack.borders(owner, inside)
    at_left, at_right = stack.heights(owner, inside)
    points = stacked_points(stack, owner, inside, t)
    cuts = np.searchsorted(owner, np.arange(len(places) + 1)).tolist()
    grids = []
    for (road, index, section), part in zip(places, map(slice, cuts[:-1], cuts[1:]), strict=True):
        lanes = built_lanes(section)
        borders = LaneBorders(inside[part], t[part], lanes, at_left[part], at_right[part])
        grids.append(SectionGrid(road, index, section, borders, points[part]))
    return grids


def inside_section(section: LaneSection, s: FloatArray) -> FloatArray:
    """Keeps s below the section's end, where polynomials may jump to the next section."""
    return np.clip(s, section.s, section.end - _BEFORE_END)


def used_borders(grid: SectionGrid) -> list[int]:
    """Returns the outermost borders that a bridge carries or a tunnel covers, without land."""
    used = [k for k, lane in enumerate(grid.borders.lanes) if lane.type not in _LAND]
    return [used[0], used[-1] + 1] if used else [0, len(grid.borders.lanes)]
