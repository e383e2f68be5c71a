"""Strips: lanes and marks between two borders, before they are joined into one surface."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.lane_borders import LaneBorders, lane_borders, section_points
from envgen_usd.opendrive.names import lane_patch_id
from envgen_usd.opendrive.sampling import section_rows

_WIDTH_OF_CURVED = 1.0
"""Widest strip in metres on roads whose cross-section is not a plane."""
_SMALLEST_WIDTH = 2e-3
_LAND = frozenset(("none", "border"))


@dataclass(frozen=True)
class Strip:
    """A part of a lane or a mark, with rows across it.

    Attributes:
        left: N x 3, left border without lane height, metres, road frame.
        right: N x 3, right border.
        height: N x 2, lane height at the left and right border.
        depth: N x 2, distance in t to the nearer outermost border of the road.
        patch: What it means.
    """

    left: FloatArray
    right: FloatArray
    height: FloatArray
    depth: FloatArray
    patch: Patch


@dataclass(frozen=True)
class SectionGrid:
    """A lane section of a road, evaluated at its rows.

    Attributes:
        road: The road.
        index: Index of the section.
        section: The section.
        borders: Lane borders at the rows.
        points: N x (L + 1) x 3, the borders' places without lane heights.
    """

    road: Road
    index: int
    section: LaneSection
    borders: LaneBorders
    points: FloatArray


def section_grids(road: Road, tolerance: float) -> Iterator[SectionGrid]:
    """Evaluates all sections of a road, each at rows that follow its curvature."""
    for index, section in enumerate(road.sections):
        if section.end - section.s >= 1e-3:
            yield _grid(road, index, section_rows(road, section, tolerance))


def part_of_grid(grid: SectionGrid, start: float, end: float) -> SectionGrid:
    """The part of a section between two places, with rows at both."""
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
    """Keeps s off the section's end, where the road's polynomials may jump to the next section."""
    return np.clip(s, section.s, section.end - 1e-7)


def triangle_strip(corners: FloatArray, patch: Patch, height: FloatArray | None = None) -> Strip:
    """A strip of one triangle (3 x 3), by default at the road's own height, else above it (3)."""
    above = np.zeros(3) if height is None else height
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    if first[0] * second[1] - first[1] * second[0] < 0:
        corners, above = corners[::-1], above[::-1]
    heights = np.column_stack([above[[0, 2]], above[[0, 1]]])
    return Strip(corners[[0, 2]], corners[[0, 1]], heights, np.zeros((2, 2)), patch)


def used_borders(grid: SectionGrid) -> list[int]:
    """Outermost borders of what a bridge carries or a tunnel covers: land beside stays outside."""
    used = [k for k, lane in enumerate(grid.borders.lanes) if lane.type not in _LAND]
    return [used[0], used[-1] + 1] if used else [0, len(grid.borders.lanes)]


def lane_strips(grid: SectionGrid) -> Iterator[Strip]:
    """Strips of all lanes of a section; several a lane where the cross-section is curved."""
    curved = grid.road.shapes is not None or grid.road.cross_section is not None
    borders = grid.borders
    for place, lane in enumerate(borders.lanes):
        t = borders.t[:, place : place + 2]
        widest = (t[:, 0] - t[:, 1]).max()
        if widest < _SMALLEST_WIDTH:
            continue
        parts = max(int(np.ceil(widest / _WIDTH_OF_CURVED)), 1) if curved else 1
        yield from _parts_of_lane(grid, place, lane, parts)


def _parts_of_lane(grid: SectionGrid, place: int, lane: Lane, parts: int) -> Iterator[Strip]:
    borders = grid.borders
    share = np.linspace(0.0, 1.0, parts + 1)
    t = borders.t[:, [place]] * (1 - share) + borders.t[:, [place + 1]] * share
    left, right = borders.height_left[:, [place]], borders.height_right[:, [place]]
    height = left * (1 - share) + right * share
    points = grid.points[:, place : place + 2]
    if parts > 1:
        points = section_points(grid.road, grid.section, borders.s, t)
    depth = np.minimum(borders.t[:, :1] - t, t - borders.t[:, -1:])
    patch = lane_patch(grid, lane)
    for k in range(parts):
        yield Strip(
            points[:, k], points[:, k + 1], height[:, k : k + 2], depth[:, k : k + 2], patch
        )


def lane_patch(grid: SectionGrid, lane: Lane) -> Patch:
    """What a lane's surface means."""
    road = grid.road
    return Patch(
        id=lane_patch_id(road.id, grid.index, lane.id),
        kind="lane",
        lane_type=lane.type,
        road=road.id,
        section=grid.index,
        lane=lane.id,
        junction=road.junction,
        material=lane.material,
    )
