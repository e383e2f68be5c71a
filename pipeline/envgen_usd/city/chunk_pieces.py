"""Which pieces of roads and lanes lie in which chunk, and what the pieces are called."""

from collections.abc import Iterable
from functools import cached_property

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, Chunk, snap
from envgen_usd.city.names import reference
from envgen_usd.models.arrays import BoolArray, FloatArray, IntArray
from envgen_usd.models.surface import LaneLine, RoadSurface

Run = tuple[Chunk, FloatArray]
"""A piece of a polyline, N x 3, within one chunk."""


class ChunkPieces:
    """Cuts the road surface into chunks: triangles by their centroid, centre lines exactly."""

    def __init__(self, surface: RoadSurface, whole: Chunk | None = None) -> None:
        """Finds the chunk of each triangle.

        Args:
            surface: All roads.
            whole: A chunk that everything is to belong to, so that nothing is cut; or none.
        """
        self._surface = surface
        self._whole = whole
        self.lanes = {lane.id: lane for lane in surface.lanes}
        self._runs: dict[str, list[Run]] = {}
        centroids = surface.vertices[:, :2][surface.triangles].mean(axis=1)
        self._tiles: IntArray = np.floor(centroids / CHUNK_SIZE).astype(np.int64)
        if whole is not None:
            self._tiles[:] = (whole.x, whole.y)

    @property
    def is_whole(self) -> bool:
        """Whether everything belongs to one chunk, so that nothing is cut."""
        return self._whole is not None

    @cached_property
    def _patch_chunks(self) -> list[set[Chunk]]:
        rows = np.column_stack([self._surface.triangle_patch, self._tiles])
        chunks: list[set[Chunk]] = [set() for _ in self._surface.patches]
        for patch, x, y in np.unique(rows, axis=0).tolist():
            chunks[patch].add(Chunk(x, y))
        return chunks

    def triangles_in(self, chunk: Chunk) -> BoolArray:
        """Which triangles belong to a chunk, T."""
        inside: BoolArray = (self._tiles == (chunk.x, chunk.y)).all(axis=1)
        return inside

    def chunks_of(self, patches: Iterable[int]) -> set[Chunk]:
        """Chunks that hold a part of one of these patches or of their centre lines."""
        found: set[Chunk] = set()
        for patch in patches:
            found |= self._patch_chunks[patch]
            name = self._surface.patches[patch].id
            if name in self.lanes:
                found.update(tile for tile, _ in self.runs(self.lanes[name]))
        return found

    def runs(self, lane: LaneLine) -> list[Run]:
        """Pieces of a centre line, in the direction of travel."""
        if lane.id not in self._runs:
            self._runs[lane.id] = self.whole_or_cut(lane.points)
        return self._runs[lane.id]

    def whole_or_cut(self, points: FloatArray) -> list[Run]:
        """Pieces of any polyline, N x 3."""
        return [(self._whole, points)] if self._whole else _cut(points)

    def chunks_of_patch(self, name: str) -> set[Chunk]:
        """Chunks that hold a part of the patch with that id."""
        return self.chunks_of([self._patch_index[name]])

    def lane_name(self, lane: LaneLine, chunk: Chunk) -> str:
        """Id of the traffic space of a lane in a chunk."""
        return piece_name(lane.id, self._lane_chunks(lane), chunk)

    def _lane_chunks(self, lane: LaneLine) -> set[Chunk]:
        patch = self._patch_index.get(lane.id)
        if patch is not None:
            return self.chunks_of([patch])
        return {tile for tile, _ in self.runs(lane)}

    @cached_property
    def _patch_index(self) -> dict[str, int]:
        return {patch.id: index for index, patch in enumerate(self._surface.patches)}

    def reference(self, name: str, chunk: Chunk) -> str:
        """Reference from a chunk's file to a lane or patch, the piece there if there is one.

        Args:
            name: Id of the lane or patch.
            chunk: The chunk.

        Returns:
            Empty where there is no such lane or patch, or nothing of it.
        """
        lane = self.lanes.get(name)
        tiles = self._lane_chunks(lane) if lane is not None else set()
        if lane is None and name in self._patch_index:
            tiles = self.chunks_of_patch(name)
        if not tiles:
            return ""
        tile = chunk if chunk in tiles else min(tiles, key=lambda each: (each.x, each.y))
        return reference(piece_name(name, tiles, tile), "" if tile == chunk else tile.name)

    def neighbours(self, lane: LaneLine, chunk: Chunk) -> dict[str, tuple[str, ...]]:
        """References to the traffic spaces around that of a lane in a chunk, by role."""
        runs = self.runs(lane)
        places = [index for index, (tile, _) in enumerate(runs) if tile == chunk]
        found: dict[str, tuple[str, ...]] = {}
        if places:
            before, after = places[0], places[-1] + 1
            found["predecessor"] = (
                (self._reference(lane, runs[before - 1][0], chunk),)
                if before > 0
                else self._ends(lane.predecessors, -1, chunk)
            )
            found["successor"] = (
                (self._reference(lane, runs[after][0], chunk),)
                if after < len(runs)
                else self._ends(lane.successors, 0, chunk)
            )
        found["laneChangeLeft"] = self._beside(lane.left, chunk)
        found["laneChangeRight"] = self._beside(lane.right, chunk)
        return {role: ids for role, ids in found.items() if ids}

    def _ends(self, ids: tuple[str, ...], end: int, chunk: Chunk) -> tuple[str, ...]:
        lanes = [self.lanes[name] for name in ids if name in self.lanes]
        ends = [(lane, self.runs(lane)) for lane in lanes]
        return tuple(self._reference(lane, runs[end][0], chunk) for lane, runs in ends if runs)

    def _reference(self, lane: LaneLine, tile: Chunk, chunk: Chunk) -> str:
        """Reference from a chunk's file to the piece of a lane in this or another chunk."""
        return reference(self.lane_name(lane, tile), "" if tile == chunk else tile.name)

    def _beside(self, name: str, chunk: Chunk) -> tuple[str, ...]:
        lane = self.lanes.get(name)
        if lane is None or chunk not in self._lane_chunks(lane):
            return ()
        return (self.lane_name(lane, chunk),)


def piece_name(name: str, chunks: set[Chunk], chunk: Chunk) -> str:
    """Id of the piece of a feature in a chunk: its own where the feature lies in one chunk."""
    return name if len(chunks) <= 1 else f"{name}_{chunk.prim_name}"


def _cut(points: FloatArray) -> list[Run]:
    """Cuts a polyline, N x 3, at the borders of chunks."""
    step = np.diff(points, axis=0)
    index, share = [np.arange(len(points))], [np.zeros(len(points))]
    for axis in (0, 1):
        tiles = points[:, axis] / CHUNK_SIZE
        low, high = np.minimum(tiles[:-1], tiles[1:]), np.maximum(tiles[:-1], tiles[1:])
        first, last = np.floor(low) + 1, np.ceil(high) - 1
        counts = np.maximum(last - first + 1, 0).astype(np.int64)
        segment = np.repeat(np.arange(len(step)), counts)
        line = np.repeat(first, counts) + _count_up(counts)
        index.append(segment)
        share.append((line - tiles[segment]) / (tiles[segment + 1] - tiles[segment]))
    where, part = np.concatenate(index), np.concatenate(share)
    order = np.lexsort((part, where))
    where, part = where[order], part[order]
    along = step[np.minimum(where, len(step) - 1)] * part[:, None]
    cut = snap(points[where] + along)
    cut = cut[np.append(True, (np.diff(cut, axis=0) != 0.0).any(axis=1))]
    return _grouped(cut) if len(cut) > 1 else []


def _count_up(counts: IntArray) -> IntArray:
    """0, 1, ... count - 1 for each count."""
    ends = np.cumsum(counts)
    return np.arange(counts.sum()) - np.repeat(ends - counts, counts)


def _grouped(points: FloatArray) -> list[Run]:
    tiles = np.floor((points[1:, :2] + points[:-1, :2]) / 2 / CHUNK_SIZE).astype(np.int64)
    starts = np.flatnonzero(np.append(True, (np.diff(tiles, axis=0) != 0).any(axis=1)))
    ends = np.append(starts[1:], len(tiles))
    return [
        (Chunk(*tiles[first].tolist()), points[first : last + 1])
        for first, last in zip(starts.tolist(), ends.tolist(), strict=True)
    ]
