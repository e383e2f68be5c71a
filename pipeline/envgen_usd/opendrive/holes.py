"""Small holes between strips, which the file does not intend, get the surface of their border."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.arrangement import Faces
from envgen_usd.opendrive.cover import Cover, junction_patch
from envgen_usd.opendrive.half_edges import half_edges
from envgen_usd.opendrive.outline import trace_loops
from envgen_usd.opendrive.strips import Strip

_WIDEST = 5.0
"""A hole whose inscribed circle is wider than this (metres) is an island and stays."""


def fill_holes(faces: Faces, cover: Cover, strips: Sequence[Strip]) -> Cover:
    """Gives the faces of small holes to the lane with which they share most of their border."""
    empty = np.flatnonzero(cover.patch < 0)
    tree = shapely.STRtree(shapely.point_on_surface(np.array(faces.polygons)[empty]))
    edges = half_edges(faces, cover.patch >= 0)
    border = edges.twin < 0
    pairs = np.column_stack([edges.start[border], edges.end[border]])
    beside = dict(zip(map(tuple, pairs.tolist()), edges.face[border].tolist(), strict=True))
    lane, patch, patches = cover.lane.copy(), cover.patch.copy(), list(cover.patches)
    for loop in trace_loops(pairs, faces.points):
        if not _is_small_hole(faces.points[loop]):
            continue
        owner = _neighbour(loop, faces.points, beside, cover.lane)
        meaning = _filler(strips[owner].patch)
        if meaning not in patches:
            patches.append(meaning)
        hole = shapely.Polygon(faces.points[loop])
        inside = empty[tree.query(hole, predicate="intersects")]
        lane[inside], patch[inside] = owner, patches.index(meaning)
    return Cover(lane, patch, tuple(patches))


def _is_small_hole(ring: FloatArray) -> bool:
    line = shapely.linearrings(ring)
    if shapely.is_ccw(line):
        return False
    circle = shapely.maximum_inscribed_circle(shapely.polygons(line), 0.05)
    return bool(2 * shapely.length(circle) <= _WIDEST)


def _neighbour(
    loop: IntArray, points: FloatArray, beside: Mapping[tuple[int, int], int], lane: IntArray
) -> int:
    """Lane strip with the longest border along a loop."""
    following = np.roll(loop, -1)
    lengths = np.hypot(*(points[following] - points[loop]).T)
    shared: dict[int, float] = {}
    for edge, length in zip(
        zip(loop.tolist(), following.tolist(), strict=True), lengths.tolist(), strict=True
    ):
        owner = int(lane[beside[edge]])
        shared[owner] = shared.get(owner, 0.0) + length
    return max(shared, key=lambda owner: (shared[owner], -owner))


def _filler(beside: Patch) -> Patch:
    if beside.junction:
        return junction_patch(beside.junction, beside.lane_type, "filler")
    return replace(beside, id=f"{beside.id}_filler", kind="filler")
