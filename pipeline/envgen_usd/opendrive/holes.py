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

_WIDEST_IN_JUNCTION = 6.0
_WIDEST = 0.5
"""Holes whose inscribed circle is wider than this (metres) are islands and stay."""


def fill_holes(faces: Faces, cover: Cover, strips: Sequence[Strip]) -> Cover:
    """Gives the faces of small holes to the lane with which they share most of their border.

    In junctions these are the gaps between connecting roads; elsewhere only slits are closed.
    """
    empty = np.flatnonzero(cover.patch < 0)
    tree = shapely.STRtree(shapely.point_on_surface(np.array(faces.polygons)[empty]))
    edges = half_edges(faces, cover.patch >= 0)
    border = edges.twin < 0
    pairs = np.column_stack([edges.start[border], edges.end[border]])
    beside = dict(zip(map(tuple, pairs.tolist()), edges.face[border].tolist(), strict=True))
    lane, patch, patches = cover.lane.copy(), cover.patch.copy(), list(cover.patches)
    for loop in trace_loops(pairs, faces.points):
        if shapely.is_ccw(shapely.linearrings(faces.points[loop])):
            continue
        owners = _neighbours(loop, faces.points, beside, cover.lane)
        owner = max(owners, key=lambda strip: (owners[strip], -strip))
        within = sum(owners[strip] for strip in owners if strips[strip].patch.junction)
        limit = _WIDEST_IN_JUNCTION if within > sum(owners.values()) / 2 else _WIDEST
        hole = shapely.Polygon(faces.points[loop])
        if _width(hole) > limit:
            continue
        meaning = _filler(strips[owner].patch)
        if meaning not in patches:
            patches.append(meaning)
        inside = empty[tree.query(hole, predicate="intersects")]
        lane[inside], patch[inside] = owner, patches.index(meaning)
    return Cover(lane, cover.several, patch, tuple(patches))


def _width(hole: shapely.Polygon) -> float:
    """Diameter of the inscribed circle."""
    return 2 * float(shapely.length(shapely.maximum_inscribed_circle(hole, 0.05)))


def _neighbours(
    loop: IntArray, points: FloatArray, beside: Mapping[tuple[int, int], int], lane: IntArray
) -> dict[int, float]:
    """Lane strips along a loop, with the length that they share with it."""
    following = np.roll(loop, -1)
    lengths = np.hypot(*(points[following] - points[loop]).T)
    edges = zip(loop.tolist(), following.tolist(), strict=True)
    shared: dict[int, float] = {}
    for edge, length in zip(edges, lengths.tolist(), strict=True):
        owner = int(lane[beside[edge]])
        shared[owner] = shared.get(owner, 0.0) + length
    return shared


def _filler(beside: Patch) -> Patch:
    if beside.junction:
        return junction_patch(beside.junction, beside.lane_type, "filler")
    return replace(beside, id=f"{beside.id}_filler", kind="filler")
