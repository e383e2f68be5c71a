"""A hem: a row of vertices along long edges of the road's outline.

The outline has vertices only at bends of the road. Without the hem, triangles of the strip would be
as long as the outline's edges. A landuse cell at the road would spread along such a triangle.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import CELL_SIZE, Chunk, snap
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.terrain.grid_nodes import codes_of

LONGEST = 2 * CELL_SIZE
"""Longest edge in metres without a hem."""
WIDTH = 0.04
"""Distance in metres of the hem from the outline; large compared with the coordinate grid."""
ROOM = 0.1
"""Metres beside an edge that have to be free of other edges, for its hem and for theirs."""


@dataclass(frozen=True)
class Hem:
    """Vertex lines beside the outline, from an edge's start along new vertices to its end.

    Attributes:
        edges: E x 2, codes of vertices (`grid_nodes.codes_of`); ground lies on both sides.
        codes: N, codes of the new vertices.
        heights: N, metres.
    """

    edges: IntArray
    codes: IntArray
    heights: FloatArray


NO_HEM = Hem(np.empty((0, 2), np.int64), np.empty(0, np.int64), np.empty(0))


def sew_hem(chunk: Chunk, edges: Outline, outline: Outline) -> Hem:
    """Places vertices at the cell size beside each long edge with enough room.

    Args:
        chunk: Chunk.
        edges: Edges in the chunk, directed with the ground to their left.
        outline: All edges in and near the chunk.
    """
    along = edges.end - edges.start
    length = np.hypot(along[:, 0], along[:, 1])
    left = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
    counts = np.where(length > LONGEST, np.ceil(length / CELL_SIZE) - 1, 0).astype(np.int64)
    counts[_crowded(edges, left, counts, outline)] = 0
    edge = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    share = (place / (counts[edge] + 1))[:, None]
    points = edges.start[edge] + share * along[edge]
    hemmed = snap(points[:, :2] + WIDTH * left[edge])
    blocked = ~np.all((hemmed > chunk.bounds[:2]) & (hemmed < chunk.bounds[2:]), axis=1)
    keep = ~np.isin(edge, edge[blocked])
    if not keep.any():
        return NO_HEM
    codes, edge = codes_of(chunk, hemmed[keep]), edge[keep]
    first = np.append(True, edge[1:] != edge[:-1])
    last = np.append(first[1:], True)
    before = np.where(first, codes_of(chunk, edges.start[edge, :2]), np.roll(codes, 1))
    ends = np.stack([codes[last], codes_of(chunk, edges.end[edge[last], :2])], axis=1)
    lines = np.concatenate([np.stack([before, codes], axis=1), ends])
    return Hem(lines, codes, snap(points[keep, 2]))


def _crowded(edges: Outline, left: FloatArray, counts: IntArray, outline: Outline) -> BoolArray:
    """Returns the edges with another edge within `ROOM` beside them."""
    crowded = np.zeros(len(edges), dtype=np.bool_)
    hemmed = np.flatnonzero(counts)
    start, end = edges.start[hemmed, :2], edges.end[hemmed, :2]
    aside, inset = ROOM * left[hemmed], (end - start) / (counts[hemmed, None] + 1)
    rooms = shapely.polygons(
        np.stack([start, end, end - inset + aside, start + inset + aside], axis=1)
    )
    lines = shapely.linestrings(np.stack([outline.start[:, :2], outline.end[:, :2]], axis=1))
    tree = shapely.STRtree(lines)
    for relation in ("crosses", "contains"):
        crowded[hemmed[tree.query(rooms, predicate=relation)[0]]] = True
    return crowded
