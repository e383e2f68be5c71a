"""Concatenation, selection and reversal of polygons and solids in flat arrays; equal rows, runs."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons, ShellPath, Solids

AnyArray = TypeVar("AnyArray", FloatArray, IntArray)


def join(parts: Sequence[Polygons]) -> Polygons:
    """Concatenates polygons."""
    if not parts:
        return Polygons.of_rings([])
    points = np.concatenate([part.points for part in parts])
    rings = _joined([part.ring_offsets for part in parts])
    polygons = _joined([part.polygon_offsets for part in parts])
    return Polygons(points, rings, polygons)


def _joined(offsets: Sequence[IntArray]) -> IntArray:
    sizes = np.concatenate([np.diff(part) for part in offsets])
    joined: IntArray = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    return joined


def join_solids(parts: Sequence[Polygons]) -> Polygons:
    """Concatenates separate solids; polygons without shells are the shell of a single solid."""
    paths: list[ShellPath] = []
    count = 0
    for part in parts:
        if isinstance(part, Solids):
            solids = (part.solid[part.shell] + count).tolist()
            paths += zip(solids, part.shell.tolist(), strict=True)
        else:
            paths += [(count, 0)] * len(part)
        count = paths[-1][0] + 1 if paths else 0
    return Solids.of_shells(join(parts), paths, composite=False)


def split_solids(polygons: Polygons) -> list[Polygons]:
    """Returns each solid by itself, with its cavities."""
    if not isinstance(polygons, Solids):
        return [polygons]
    owner = polygons.solid[polygons.shell]
    members = [np.flatnonzero(owner == solid) for solid in np.unique(owner)]
    paths = [[(0, shell) for shell in polygons.shell[own].tolist()] for own in members]
    return [
        Solids.of_shells(take(polygons, own), path, composite=False)
        for own, path in zip(members, paths, strict=True)
    ]


def take(polygons: Polygons, chosen: IntArray) -> Polygons:
    """Selects polygons by their indices (C), in that order."""
    rings, ring_sizes = _members(polygons.polygon_offsets, chosen)
    points, sizes = _members(polygons.ring_offsets, rings)
    return Polygons(
        polygons.points[points],
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        np.concatenate([[0], np.cumsum(ring_sizes)]).astype(np.int64),
    )


def turned(polygons: Polygons, which: BoolArray | None = None) -> Polygons:
    """Reverses all rings of polygons, so that these face the opposite side.

    Args:
        polygons: P polygons.
        which: P, true for polygons to reverse; `None` reverses all.
    """
    sizes = np.diff(polygons.ring_offsets)
    ends = np.repeat(polygons.ring_offsets[1:], sizes)
    starts = np.repeat(polygons.ring_offsets[:-1], sizes)
    order = np.arange(len(polygons.points))
    backwards = starts + ends - 1 - order
    if which is not None:
        of_ring = np.repeat(which, np.diff(polygons.polygon_offsets))
        backwards = np.where(np.repeat(of_ring, sizes), backwards, order)
    return replace(polygons, points=polygons.points[backwards])


def _members(offsets: IntArray, chosen: IntArray) -> tuple[IntArray, IntArray]:
    """Returns the indices of the members of the chosen groups, and the sizes of these groups."""
    sizes = offsets[chosen + 1] - offsets[chosen]
    return spans(offsets[chosen], sizes), sizes


def spans(starts: IntArray, sizes: IntArray) -> IntArray:
    """Concatenates the ranges ``start, start + 1, ...`` of S spans."""
    ends = np.cumsum(sizes)
    indices: IntArray = np.repeat(starts - (ends - sizes), sizes)
    indices += np.arange(len(indices))
    return indices


def true_runs(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """Returns the first index of each run of true values, and the index after its last."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def first_equal_row(rows: FloatArray | IntArray) -> IntArray:
    """Returns for each of N rows (N x C) the index of the first equal row, N."""
    if not len(rows):
        return np.empty(0, dtype=np.int64)
    order = np.lexsort(rows.T)
    ordered = rows[order]
    starts = np.ones(len(rows), dtype=bool)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first: IntArray = np.empty(len(rows), dtype=np.int64)
    # The sort is stable, so each run of equal rows starts with the first of them.
    first[order] = order[starts][np.cumsum(starts) - 1]
    return first


def distinct_rows(rows: IntArray) -> tuple[IntArray, IntArray]:
    """Returns the first of equal rows (N x C), ascending by row, and the place of each row, N."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    place: IntArray = np.empty(len(rows), dtype=np.int64)
    place[order] = np.cumsum(new) - 1
    return order[new], place


def ascending(values: AnyArray) -> AnyArray:
    """Returns the distinct values, ascending; `numpy.unique` hashes them, which takes longer."""
    ordered = np.sort(values)
    new = np.ones(len(ordered), dtype=bool)
    new[1:] = ordered[1:] != ordered[:-1]
    return ordered[new]
