"""Edges of the surface with the heights on both sides."""

from typing import NamedTuple

import numpy as np

from envgen_usd.models.array_types import IntArray
from envgen_usd.opendrive.mesh.half_edges import HalfEdges


class Seams(NamedTuple):
    """E undirected edges of the arrangement; heights in grid units.

    Attributes:
        start: E, vertex of the arrangement at the start.
        end: E, vertex of the arrangement at the end.
        face: E, face on the left.
        opposite: E, face on the right; -1 for the ground.
        left: E x 2, height of the left surface at start and end.
        right: E x 2, height of the right surface or the ground at start and end.
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
        corner_z: Height at each ring vertex of each face, grid units.
    """
    border = edges.twin < 0
    once = border | (edges.twin > np.arange(len(edges.twin)))
    left = np.column_stack([corner_z[edges.start_corner], corner_z[edges.end_corner]])
    other = left[edges.twin][:, ::-1].copy()
    lowest = np.full(int(edges.start.max()) + 1, np.iinfo(np.int64).max)
    np.minimum.at(lowest, edges.start, left[:, 0])
    other[border] = np.column_stack([lowest[edges.start], lowest[edges.end]])[border]
    opposite = np.where(border, -1, edges.face[edges.twin])
    return Seams(
        edges.start[once],
        edges.end[once],
        edges.face[once],
        opposite[once],
        left[once],
        other[once],
    )
