"""Half-edges of selected faces of an arrangement, with their twins."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.opendrive.mesh.arrangement import Faces


@dataclass(frozen=True)
class HalfEdges:
    """H directed edges, each with its face on the left.

    Attributes:
        start: H, vertex of the arrangement at the start.
        end: H, vertex of the arrangement at the end.
        face: H, face on the left.
        start_corner: H, index of (face, start) in the arrangement's ring vertices.
        end_corner: H, index of (face, end) in the arrangement's ring vertices.
        twin: H, the opposite half-edge; -1 at the border.
    """

    start: IntArray
    end: IntArray
    face: IntArray
    start_corner: IntArray
    end_corner: IntArray
    twin: IntArray


def half_edges(faces: Faces, chosen: BoolArray) -> HalfEdges:
    """Returns the half-edges of selected faces (F)."""
    counts = np.diff(faces.ring_start)
    ring = np.repeat(np.arange(len(counts)), counts)
    corner = np.arange(len(faces.ring_vertices))
    following = corner + 1
    following[faces.ring_start[1:] - 1] = faces.ring_start[:-1]
    face = faces.ring_face[ring]
    keep = chosen[face]
    corner, following, face = corner[keep], following[keep], face[keep]
    start, end = faces.ring_vertices[corner], faces.ring_vertices[following]
    return HalfEdges(start, end, face, corner, following, _twins(start, end, len(faces.points)))


def _twins(start: IntArray, end: IntArray, count: int) -> IntArray:
    # Both half-edges of an edge are neighbours in the order of their ends.
    edge = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(edge)
    first = np.flatnonzero(np.diff(edge[order]) == 0)
    one, other = order[first], order[first + 1]
    twins: IntArray = np.full(len(edge), -1)
    twins[one], twins[other] = other, one
    return twins
