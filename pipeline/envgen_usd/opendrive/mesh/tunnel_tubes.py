"""Tunnels: walls and a ceiling over a road stretch (1.8.1, 13.11)."""

from collections.abc import Iterator, Sequence

import numpy as np

from envgen_usd.chunks import GRID
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.geometry.section_grids import SectionGrid, part_of_grid, used_borders
from envgen_usd.opendrive.mesh.lift import Mesh
from envgen_usd.opendrive.surface_ids import nc_name

_CLEARANCE = 5.0
"""Inner height of a tunnel in metres."""
_WALL = 0.5
"""Thickness of walls and ceiling in metres."""
_FOOT = 0.5
"""Depth of the walls below the road in metres; a larger value closes gaps at the ground."""
_LEAST_LENGTH = 0.1
"""Metres below which a tunnel in a lane section is left out."""
_SECTION = np.array(
    [
        (0, 0.0, -_FOOT),
        (0, 0.0, _CLEARANCE),
        (1, 0.0, _CLEARANCE),
        (1, 0.0, -_FOOT),
        (1, _WALL, -_FOOT),
        (1, _WALL, _CLEARANCE + _WALL),
        (0, _WALL, _CLEARANCE + _WALL),
        (0, _WALL, -_FOOT),
    ]
)
"""Corners of the tube: side (0 left, 1 right), metres outwards, metres above the border."""


def tunnel_tubes(grids: Sequence[SectionGrid]) -> list[Mesh]:
    """Returns a tube over each tunnel of the roads, open at its ends."""
    return [
        _tube(rows, _patch(grid.road, grid.index)) for grid in grids for rows in _tunnel_rows(grid)
    ]


def is_tunnel(road: Road, road_object: RoadObject) -> bool:
    """Returns whether an object is a tunnel over a stretch of its road."""
    start, end = max(road_object.s, 0.0), min(road_object.s + road_object.length, road.length)
    return road_object.type == "tunnel" and end - start > _LEAST_LENGTH


def _tunnel_rows(grid: SectionGrid) -> Iterator[FloatArray]:
    """Yields the left and right border of the lanes inside each tunnel, N x 2 x 3."""
    first, last = float(grid.borders.s[0]), float(grid.borders.s[-1])
    for road_object in grid.road.objects:
        start, end = max(road_object.s, first), min(road_object.s + road_object.length, last)
        long = end - start > _LEAST_LENGTH
        if road_object.type == "tunnel" and long and grid.points.shape[1] > 1:
            yield part_of_grid(grid, start, end).points[:, used_borders(grid)]


def _tube(rows: FloatArray, patch: Patch) -> Mesh:
    across = rows[:, 1, :2] - rows[:, 0, :2]
    across /= np.maximum(np.hypot(*across.T), 1e-9)[:, None]
    side = _SECTION[:, 0].astype(int)
    sign = np.where(side == 1, 1.0, -1.0)
    corners = rows[:, side].copy()
    corners[..., :2] += (sign * _SECTION[:, 1])[None, :, None] * across[:, None]
    corners[..., 2] += _SECTION[:, 2]
    count, ring = len(rows), len(_SECTION)
    row, place = (part.ravel() for part in np.mgrid[: count - 1, :ring])
    here, beside = row * ring + place, row * ring + (place + 1) % ring
    quads = [here, here + ring, beside + ring, here, beside + ring, beside]
    triangles = np.column_stack(quads).reshape(-1, 3)
    ends = [_mouth(0), _mouth((count - 1) * ring)[:, ::-1]]
    triangles = np.concatenate([triangles, *ends])
    vertices = np.round(corners.reshape(-1, 3) / GRID) / round(1 / GRID)
    return Mesh(vertices, triangles, np.zeros(len(triangles), dtype=np.int64), (patch,), ())


def _mouth(first: int) -> FloatArray:
    """Returns triangles that close the wall thickness at a portal: left wall, ceiling, right."""
    faces = [(0, 1, 6), (0, 6, 7), (1, 2, 5), (1, 5, 6), (2, 3, 4), (2, 4, 5)]
    return np.array(faces) + first


def _patch(road: Road, section: int) -> Patch:
    return Patch(
        id=f"tunnel_road_{nc_name(road.id)}_s{section}",
        kind="deck",
        lane_type="none",
        road=road.id,
        section=section,
        junction=road.junction,
        material="concrete",
    )
