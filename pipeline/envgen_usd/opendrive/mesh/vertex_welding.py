"""Merges vertices that are too near each other."""

import numpy as np

from envgen_usd.geometry.flat_arrays import spans
from envgen_usd.models.array_types import IntArray

_SPAN = 1 << 34
_BESIDE = ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1))
"""Half of the buckets around a bucket; the other half sees it from the other side."""


def weld(points: IntArray, apart: int) -> IntArray:
    """Merges points nearer than a distance into one of them; earlier points stay.

    The points that stay are a maximal set of points at least ``apart`` from each other. Every other
    point moves to the nearest of these.

    Args:
        points: 2 x N, distinct, grid units.
        apart: Distance in grid units, measured along the axes.

    Returns:
        N, index of the point that each point moves to.
    """
    into = np.arange(points.shape[1])
    first, second = _close_pairs(points, apart)
    if not len(first):
        return into
    here, there = np.concatenate([first, second]), np.concatenate([second, first])
    waiting = np.zeros(len(into), dtype=bool)
    waiting[here] = True
    stays = ~waiting
    while waiting.any():
        open_pair = waiting[here] & waiting[there]
        earliest = np.full(len(into), len(into))
        np.minimum.at(earliest, here[open_pair], there[open_pair])
        chosen = np.flatnonzero(waiting)
        chosen = chosen[chosen < earliest[chosen]]
        stays[chosen] = True
        waiting[chosen] = False
        waiting[here[stays[there]]] = False
    moves = stays[there] & ~stays[here]
    here, there = here[moves], there[moves]
    distance = ((points[:, here] - points[:, there]) ** 2).sum(axis=0)
    order = np.lexsort((there, distance, here))
    moved, nearest = np.unique(here[order], return_index=True)
    into[moved] = there[order][nearest]
    return into


def _close_pairs(points: IntArray, apart: int) -> tuple[IntArray, IntArray]:
    """Returns pairs of points nearer than a distance, each once."""
    bucket = points // apart
    keys = bucket[0] * _SPAN + bucket[1]
    order = np.argsort(keys)
    keys = keys[order]
    pairs = []
    for x, y in _BESIDE:
        low = np.searchsorted(keys, keys + (x * _SPAN + y), side="left")
        count = np.searchsorted(keys, keys + (x * _SPAN + y), side="right") - low
        if (x, y) == (0, 0):
            low = np.arange(1, len(keys) + 1)
            count = np.searchsorted(keys, keys, side="right") - low
        pairs.append(np.stack([np.repeat(order, count), order[spans(low, count)]]))
    first, second = np.concatenate(pairs, axis=1)
    apart_by = np.abs(points[:, first] - points[:, second])
    near = (apart_by[0] < apart) & (apart_by[1] < apart)
    return first[near], second[near]
