"""Edges of the surface with the heights of what lies on both sides."""

from typing import NamedTuple

import numpy as np

from envgen_usd.models.arrays import IntArray
from envgen_usd.opendrive.half_edges import HalfEdges


class Seams(NamedTuple):
    """Edges of the arrangement, each once; heights in grid steps.

    Attributes:
        start: E, vertex of the arrangement.
        end: E.
        face: E, face on the left.
        opposite: E, face on the right, -1 for the ground.
        left: E x 2, height of the surface on the left at start and end.
        right: E x 2, of the surface or the ground on the right.
    """

    start: IntArray
    end: IntArray
    face: IntArray
    opposite: IntArray
    left: IntArray
    right: IntArray


def find_seams(edges: HalfEdges, corner_z: IntArray) -> Seams:
    """Joins half-edges to seams; the ground meets the border at the lowest height there.

    Args:
        edges: Half-edges of the covered faces.
        corner_z: Height at each ring vertex of each face, grid steps.
    """
    border = edges.twin < 0
    once = border | (edges.twin > np.arange(len(edges.twin)))
    own = np.column_stack([corner_z[edges.start_corner], corner_z[edges.end_corner]])
    other = own[edges.twin][:, ::-1].copy()
    lowest = np.full(int(edges.start.max()) + 1, np.iinfo(np.int64).max)
    np.minimum.at(lowest, edges.start, own[:, 0])
    other[border] = np.column_stack([lowest[edges.start], lowest[edges.end]])[border]
    opposite = np.where(border, -1, edges.face[edges.twin])
    return Seams(
        edges.start[once],
        edges.end[once],
        edges.face[once],
        opposite[once],
        own[once],
        other[once],
    )
