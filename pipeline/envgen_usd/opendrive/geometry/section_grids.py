"""Lane sections, evaluated at rows that follow the road's curvature."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.lane_borders import LaneBorders, lane_borders, section_points
from envgen_usd.opendrive.geometry.row_sampling import section_rows

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


def section_grids(road: Road, tolerance: float) -> Iterator[SectionGrid]:
    """Yields all sections of a road, each at rows that follow its curvature."""
    for index, section in enumerate(road.sections):
        if section.end - section.s >= 1e-3:
            yield _grid(road, index, section_rows(road, section, tolerance))


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


def inside_section(section: LaneSection, s: FloatArray) -> FloatArray:
    """Keeps s below the section's end, where polynomials may jump to the next section."""
    return np.clip(s, section.s, section.end - 1e-7)


def used_borders(grid: SectionGrid) -> list[int]:
    """Returns the outermost borders that a bridge carries or a tunnel covers, without land."""
    used = [k for k, lane in enumerate(grid.borders.lanes) if lane.type not in _LAND]
    return [used[0], used[-1] + 1] if used else [0, len(grid.borders.lanes)]
