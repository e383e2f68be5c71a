"""Area of junctions with a boundary in the file (1.8.1, 12.10)."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.junctions import BoundarySegment, Junction
from envgen_usd.models.lanes import LaneSection
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.opendrive.geometry.lane_borders import lane_borders, section_points
from envgen_usd.opendrive.geometry.row_sampling import section_rows
from envgen_usd.opendrive.geometry.section_grids import inside_section
from envgen_usd.opendrive.strips.lane_strips import Strip, junction_patch
from envgen_usd.opendrive.strips.triangle_strips import ring_strips

_LEAST_AREA = 0.1
"""Area in square metres below which a boundary is left out."""


def boundary_strips(network: RoadNetwork, tolerance: float) -> Iterator[Strip]:
    """Yields the area within junction boundaries as triangles; lanes lie over it.

    Lane segments follow the outer border of the lane; joints run straight across a road's end.
    """
    for junction in network.junctions.values():
        ring = _ring(network, junction, tolerance)
        if len(ring) > 2:
            patch = junction_patch(junction.id, "driving", "junction")
            yield from ring_strips(ring, _LEAST_AREA, patch)


def _ring(network: RoadNetwork, junction: Junction, tolerance: float) -> FloatArray:
    """Returns the boundary without repeated points, N x 3, metres, road frame."""
    pieces: list[FloatArray] = []
    for segment in junction.boundary:
        road = network.roads.get(segment.road)
        if road is None or not road.sections:
            continue
        piece = (
            _joint(road, segment)
            if segment.type == "joint"
            else _along_lane(road, segment, tolerance)
        )
        if segment.type == "joint" and pieces and len(piece):
            apart = np.linalg.norm(piece[[0, -1], :2] - pieces[-1][-1, :2], axis=1)
            piece = piece if apart[0] <= apart[1] else piece[::-1]
        if len(piece):
            pieces.append(piece)
    if not pieces:
        return np.empty((0, 3))
    ring = np.concatenate(pieces)
    moved = np.linalg.norm(np.diff(ring[:, :2], axis=0, append=ring[:1, :2]), axis=1)
    distinct: FloatArray = ring[moved > 1e-3]
    return distinct


def _along_lane(road: Road, segment: BoundarySegment, tolerance: float) -> FloatArray:
    """Returns a lane's outer border from sStart to sEnd, also against s."""
    start, end = np.clip(np.nan_to_num([segment.s_start, segment.s_end]), 0.0, road.length)
    low, high = min(start, end), max(start, end)
    points = []
    for section in road.sections:
        if section.end <= low or section.s >= high or section.end - section.s < 1e-3:
            continue
        rows = section_rows(road, section, tolerance)
        rows = np.unique(np.clip(rows, low, high))
        points.append(_border(road, section, rows, segment.lane))
    along = np.concatenate(points) if points else np.empty((0, 3))
    return along if start <= end else along[::-1]


def _border(road: Road, section: LaneSection, s: FloatArray, lane: int) -> FloatArray:
    """Returns a lane's outer border, or the centre for lane 0; a missing lane is outermost."""
    inside = inside_section(section, s)
    borders = lane_borders(road, section, inside)
    count = len(section.left)
    column = int(np.clip(count - lane, 0, borders.t.shape[1] - 1))
    border: FloatArray = section_points(road, section, inside, borders.t[:, [column]])[:, 0]
    return border


def _joint(road: Road, segment: BoundarySegment) -> FloatArray:
    """Returns two corners across a road's end."""
    at_start = segment.contact_point == "start"
    section = road.sections[0 if at_start else -1]
    s = np.array([section.s if at_start else section.end])
    first = len(section.left) if segment.joint_lane_start is None else segment.joint_lane_start
    last = -len(section.right) if segment.joint_lane_end is None else segment.joint_lane_end
    return np.concatenate([_border(road, section, s, lane) for lane in (first, last)])
