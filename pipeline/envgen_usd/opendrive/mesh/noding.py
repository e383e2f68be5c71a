"""Nodes segments on a grid: splits them at all crossings and contacts.

Snap rounding (Hobby 1999, in GEOS) keeps the result on the grid. Its cost grows faster than the
number of segments. It therefore runs chunk by chunk along the longer side of the map.
"""

from collections.abc import Iterator

import numpy as np
import shapely

from envgen_usd.chunks import CHUNK_SIZE, GRID
from envgen_usd.models.array_types import BoolArray, IntArray

_STEP = round(CHUNK_SIZE / GRID)


def noded(segments: IntArray) -> IntArray:
    """Splits segments so that they meet at common ends only.

    1. Segments are split at chunk borders, at the nearest grid position.
    2. The segments of each chunk are noded.
    3. Segments on a border are split at all contacts from either side.

    Args:
        segments: N x 2 x 2, grid units, without zero lengths.

    Returns:
        M x 2 x 2, grid units, without zero lengths.
    """
    axis = int(np.argmax(np.ptp(segments.reshape(-1, 2), axis=0)))
    along = _on_border(segments, axis)
    split, chunk = _split(segments[~along], axis)
    order = np.argsort(chunk, kind="stable")
    groups = np.split(split[order], np.flatnonzero(np.diff(chunk[order])) + 1)
    edges = np.concatenate([_cut(group) for group in groups])
    aside = _on_border(edges, axis)
    borders = np.concatenate([segments[along], edges[aside]])
    return np.concatenate([edges[~aside], *_border_edges(borders, edges, axis)])


def _on_border(segments: IntArray, axis: int) -> BoolArray:
    place = segments[:, :, axis]
    on_border: BoolArray = (place[:, 0] == place[:, 1]) & (place[:, 0] % _STEP == 0)
    return on_border


def _split(segments: IntArray, axis: int) -> tuple[IntArray, IntArray]:
    """Splits segments at chunk borders; returns the pieces and the chunk of each."""
    rising = segments[:, 0, axis] <= segments[:, 1, axis]
    ordered = np.where(rising[:, None, None], segments, segments[:, ::-1])
    low, high = ordered[:, 0], ordered[:, 1]
    first = low[:, axis] // _STEP
    last = np.maximum(-(-high[:, axis] // _STEP) - 1, first)
    count = last - first + 1
    owner = np.repeat(np.arange(len(segments)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    chunk = first[owner] + number
    begin = _crossing(low[owner], high[owner], chunk * _STEP, axis)
    end = _crossing(low[owner], high[owner], (chunk + 1) * _STEP, axis)
    begin = np.where((number == 0)[:, None], low[owner], begin)
    end = np.where((chunk == last[owner])[:, None], high[owner], end)
    return np.stack([begin, end], axis=1), chunk


def _crossing(low: IntArray, high: IntArray, border: IntArray, axis: int) -> IntArray:
    """Returns the crossings of segments with a border, on the grid."""
    span = np.maximum(high[:, axis] - low[:, axis], 1)
    share = (border - low[:, axis]) / span
    crossing: IntArray = np.round(low + share[:, None] * (high - low)).astype(np.int64)
    crossing[:, axis] = border
    return crossing


def _cut(segments: IntArray) -> IntArray:
    """Splits the segments of a chunk at their crossings."""
    lines = shapely.multilinestrings(shapely.linestrings(segments * GRID))
    network = shapely.get_parts(shapely.union_all(lines, grid_size=GRID))
    places, line = shapely.get_coordinates(network, return_index=True)
    steps = np.round(places / GRID).astype(np.int64)
    following = line[1:] == line[:-1]
    return np.stack([steps[:-1][following], steps[1:][following]], axis=1)


def _border_edges(borders: IntArray, edges: IntArray, axis: int) -> Iterator[IntArray]:
    """Yields the segments on each border, split at their ends and at those of all contacts."""
    ends = np.concatenate([borders, edges]).reshape(-1, 2)
    for place in np.unique(borders[:, 0, axis]).tolist():
        spans = np.sort(borders[borders[:, 0, axis] == place][:, :, 1 - axis], axis=1)
        nodes = np.unique(ends[ends[:, axis] == place][:, 1 - axis])
        change = np.bincount(np.searchsorted(nodes, spans[:, 0]), minlength=len(nodes))
        change = change - np.bincount(np.searchsorted(nodes, spans[:, 1]), minlength=len(nodes))
        covered = np.flatnonzero(np.cumsum(change)[:-1] > 0)
        pieces = np.full((len(covered), 2, 2), place)
        pieces[:, :, 1 - axis] = np.column_stack([nodes[covered], nodes[covered + 1]])
        yield pieces
