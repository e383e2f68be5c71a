"""Ground edges along the border of a chunk; both chunks at a border get the same edges."""

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.terrain.grid_nodes import codes_of

DROP_DISTANCE = 0.2
"""Metres from the outline within which grid corners on a chunk border are no vertices. The value
is less than `ground_cells.CLEARANCE`, so clear cells keep their corners."""


def border_edges(chunk: Chunk, outline: Outline, near: Outline, clear: BoolArray) -> IntArray:
    """Returns the pieces of the chunk's border that bound the ground strip.

    Args:
        chunk: Chunk.
        outline: The whole road outline.
        near: Outline edges in and near the chunk.
        clear: 255 x 255, cells outside the strip.

    Returns:
        E x 2, codes of the ends (`grid_nodes.codes_of`), counter-clockwise around the chunk.
    """
    x, y = chunk.corner_axes()
    low, high = np.array(chunk.bounds).reshape(2, 2)
    pieces = []
    for axis, level, along, backwards, cells in (
        (1, low[1], x, False, clear[0]),
        (0, high[0], y, False, clear[:, -1]),
        (1, high[1], x, True, clear[-1]),
        (0, low[0], y, True, clear[:, 0]),
    ):
        ends = _border_pieces(near, axis, level, along)
        cell = np.searchsorted(along, ends.mean(axis=1)[:, 1 - axis]) - 1
        ends = ends[~cells[cell]]
        codes = codes_of(chunk, ends[_off_road(outline, near, axis, level, ends)])
        pieces.append(codes[:, ::-1] if backwards else codes)
    return np.concatenate(pieces)


def _border_pieces(near: Outline, axis: int, level: float, along: FloatArray) -> FloatArray:
    """Returns the pieces of a border line between vertices, P x 2 x 2 (ends, xy), ascending.

    Both chunks at the border get identical pieces.
    """
    corners = np.full((len(along), 2), level)
    corners[:, 1 - axis] = along
    distance, _ = near.nearest(corners, 1.0)
    distance[[0, -1]] = np.inf
    on_line = near.start[near.start[:, axis] == level, 1 - axis]
    on_line = on_line[(on_line >= along[0]) & (on_line <= along[-1])]
    stops = np.unique(np.concatenate([along[distance >= DROP_DISTANCE], on_line]))
    ends = np.full((len(stops) - 1, 2, 2), level)
    ends[:, 0, 1 - axis], ends[:, 1, 1 - axis] = stops[:-1], stops[1:]
    return ends


def _off_road(
    outline: Outline, near: Outline, axis: int, level: float, ends: FloatArray
) -> BoolArray:
    """Returns whether pieces of a border line are off the road and off its outline."""
    middle = ends.mean(axis=1)
    flat = (near.start[:, axis] == level) & (near.end[:, axis] == level)
    spans = np.sort(np.stack([near.start[flat, 1 - axis], near.end[flat, 1 - axis]]), axis=0)
    place = middle[:, 1 - axis, None]
    along_outline = np.any((spans[0] < place) & (place < spans[1]), axis=1)
    off: BoolArray = ~along_outline & ~outline.encloses(middle)
    return off
