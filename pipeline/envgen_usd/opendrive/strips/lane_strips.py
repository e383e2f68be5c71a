"""Strips of lanes and marks between two borders: the input of the planar arrangement."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import Lane
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.geometry.lane_borders import section_points
from envgen_usd.opendrive.geometry.section_grids import SectionGrid
from envgen_usd.opendrive.surface_ids import lane_patch_id, nc_name

_WIDTH_OF_CURVED = 1.0
"""Widest strip in metres on curved cross-sections; a smaller value follows the curve closer."""
_SMALLEST_WIDTH = 2e-3
"""Least width in metres of a strip; narrower lanes are left out."""


@dataclass(frozen=True)
class Strip:
    """A part of a lane or mark as rows of two points.

    Attributes:
        left: N x 3, left border without lane height, metres, road frame.
        right: N x 3, right border without lane height, metres, road frame.
        height: N x 2, lane height at the left and right border, metres.
        depth: N x 2, distance in t from the nearer outermost border of the road, metres.
        patch: Semantics of the strip.
    """

    left: FloatArray
    right: FloatArray
    height: FloatArray
    depth: FloatArray
    patch: Patch


def lane_strips(grid: SectionGrid) -> Iterator[Strip]:
    """Yields the strips of all lanes of a section; several per lane on a curved cross-section."""
    curved = grid.road.shapes is not None or grid.road.cross_section is not None
    borders = grid.borders
    widest = (borders.t[:, :-1] - borders.t[:, 1:]).max(axis=0).tolist()
    depth = np.minimum(borders.t[:, :1] - borders.t, borders.t - borders.t[:, -1:])
    height = np.stack([borders.height_left, borders.height_right], axis=2)
    for place, lane in enumerate(borders.lanes):
        if widest[place] < _SMALLEST_WIDTH:
            continue
        parts = max(int(np.ceil(widest[place] / _WIDTH_OF_CURVED)), 1) if curved else 1
        if parts > 1:
            yield from _parts_of_lane(grid, place, lane, parts)
            continue
        yield Strip(
            grid.points[:, place],
            grid.points[:, place + 1],
            height[:, place],
            depth[:, place : place + 2],
            lane_patch(grid, lane),
        )


def _parts_of_lane(grid: SectionGrid, place: int, lane: Lane, parts: int) -> Iterator[Strip]:
    borders = grid.borders
    share = np.linspace(0.0, 1.0, parts + 1)
    t = borders.t[:, [place]] * (1 - share) + borders.t[:, [place + 1]] * share
    left, right = borders.height_left[:, [place]], borders.height_right[:, [place]]
    height = left * (1 - share) + right * share
    points = section_points(grid.road, grid.section, borders.s, t)
    depth = np.minimum(borders.t[:, :1] - t, t - borders.t[:, -1:])
    patch = lane_patch(grid, lane)
    for k in range(parts):
        yield Strip(
            points[:, k], points[:, k + 1], height[:, k : k + 2], depth[:, k : k + 2], patch
        )


def lane_patch(grid: SectionGrid, lane: Lane) -> Patch:
    """Returns the patch of a lane."""
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


def junction_patch(junction: str, lane_type: str, kind: str) -> Patch:
    """Returns the patch of a junction's shared area."""
    return Patch(
        id=f"junction_{nc_name(junction)}_{kind}_{nc_name(lane_type)}",
        kind=kind,
        lane_type=lane_type,
        junction=junction,
    )
