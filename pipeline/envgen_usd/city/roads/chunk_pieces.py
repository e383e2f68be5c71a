"""Pieces of roads and lanes by chunk, and their ids."""

from collections.abc import Iterator, Set

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, GRID, Chunk, snap, tiles_of
from envgen_usd.city.feature_ids import reference
from envgen_usd.geometry.square_index import Bounds, LineIndex
from envgen_usd.geometry.unique_rows import unique_rows
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.road_surface import LaneLine, RoadSurface

Run = tuple[Chunk, FloatArray]
"""A piece of a polyline, N x 3, within a chunk."""


class ChunkPieces:
    """Cuts the road surface into chunks: triangles by their centroid, centre lines exactly.

    The pieces are made once for a map; what lies in a chunk is then found without a look at all
    that lies elsewhere.

    Attributes:
        lanes: Centre lines by id.
    """

    def __init__(self, surface: RoadSurface, whole: Chunk | None = None) -> None:
        """Computes the chunk of each triangle.

        Args:
            surface: All roads.
            whole: A chunk for the whole surface without cuts; or `None`.
        """
        self._surface = surface
        self._whole = whole
        self.lanes = {lane.id: lane for lane in surface.lanes}
        # What was asked before: a long road is cut once, and not for each chunk that it crosses.
        self._runs: dict[str, list[Run]] = {}
        self._chunks: dict[int, frozenset[Chunk]] = {}
        self._patch_index = {patch.id: index for index, patch in enumerate(surface.patches)}
        centroids = surface.vertices[:, :2][surface.triangles].mean(axis=1)
        tiles = tiles_of(centroids)
        if whole is not None:
            tiles[:] = (whole.x, whole.y)
        first, tile = unique_rows(tiles)
        self._tiles = [Chunk(x, y) for x, y in tiles[first].tolist()]
        order = np.argsort(tile, kind="stable")
        starts = np.searchsorted(tile[order], np.arange(len(first)))
        rows = np.split(order, starts)[1:]
        self._triangles: dict[Chunk, IntArray] = dict(zip(self._tiles, rows, strict=True))
        pairs = np.unique(surface.triangle_patch * len(first) + tile)
        patch, self._tile_of_pair = np.divmod(pairs, max(len(first), 1))
        self._pairs_of_patch = np.searchsorted(patch, np.arange(len(surface.patches) + 1))
        widths = [lane.width.max(initial=0.0) / 2 for lane in surface.lanes]
        self._lines = LineIndex.of([lane.points for lane in surface.lanes], np.array(widths))

    @property
    def is_whole(self) -> bool:
        """True if a single chunk holds the whole surface."""
        return self._whole is not None

    def bounds_of(self, chunk: Chunk) -> Bounds:
        """Rectangle that holds what belongs to a chunk: without end where nothing is cut."""
        return (-np.inf, -np.inf, np.inf, np.inf) if self.is_whole else chunk.bounds

    def patches_in(self, chunk: Chunk) -> Iterator[tuple[int, IntArray]]:
        """Returns index and triangles of each patch that has a part in a chunk, by index.

        A lane has one where only its centre line passes, without triangles.
        """
        owner = self._surface.triangle_patch
        inside = self._triangles.get(chunk, np.empty(0, dtype=np.int64))
        inside = inside[np.argsort(owner[inside], kind="stable")]
        numbers, starts = np.unique(owner[inside], return_index=True)
        rows_of_patch = dict(zip(numbers.tolist(), np.split(inside, starts)[1:], strict=True))
        for lane in self.lanes_in(chunk):
            if lane.id in self._patch_index:
                rows_of_patch.setdefault(self._patch_index[lane.id], np.empty(0, dtype=np.int64))
        yield from sorted(rows_of_patch.items(), key=lambda pair: pair[0])

    def lanes_in(self, chunk: Chunk) -> tuple[LaneLine, ...]:
        """Returns the lanes whose centre lines have a piece in a chunk."""
        lanes = self.lanes_near(self.bounds_of(chunk), GRID)
        return tuple(lane for lane in lanes if any(tile == chunk for tile, _ in self.runs(lane)))

    def lanes_near(self, bounds: Bounds, margin: float) -> tuple[LaneLine, ...]:
        """Returns at least the lanes that come within a margin of a rectangle, metres."""
        lanes = self._surface.lanes
        return tuple(lanes[number] for number in self._lines.near(bounds, margin).tolist())

    def has_area(self, name: str) -> bool:
        """Whether there is a patch with that id."""
        return name in self._patch_index

    def chunks_of(self, patch: int) -> frozenset[Chunk]:
        """Chunks that hold a part of a patch or of its centre line."""
        if patch not in self._chunks:
            first, last = self._pairs_of_patch[patch : patch + 2].tolist()
            tiles = [self._tiles[tile] for tile in self._tile_of_pair[first:last].tolist()]
            lane = self.lanes.get(self._surface.patches[patch].id)
            runs = self.runs(lane) if lane is not None else []
            self._chunks[patch] = frozenset((*tiles, *(tile for tile, _ in runs)))
        return self._chunks[patch]

    def runs(self, lane: LaneLine) -> list[Run]:
        """Pieces of a centre line, in the direction of travel."""
        if lane.id not in self._runs:
            self._runs[lane.id] = self.whole_or_cut(lane.points)
        return self._runs[lane.id]

    def whole_or_cut(self, points: FloatArray) -> list[Run]:
        """Pieces of a polyline, N x 3."""
        return [(self._whole, points)] if self._whole else _cut(points)

    def chunks_of_patch(self, name: str) -> frozenset[Chunk]:
        """Chunks that hold a part of the patch with that id."""
        return self.chunks_of(self._patch_index[name])

    def lane_name(self, lane: LaneLine, chunk: Chunk) -> str:
        """Id of a lane's traffic space in a chunk."""
        return piece_name(lane.id, self._lane_chunks(lane), chunk)

    def _lane_chunks(self, lane: LaneLine) -> Set[Chunk]:
        patch = self._patch_index.get(lane.id)
        if patch is not None:
            return self.chunks_of(patch)
        return {tile for tile, _ in self.runs(lane)}

    def reference(self, name: str, chunk: Chunk) -> str:
        """Reference from a chunk's file to a lane or patch, if possible to the piece in the chunk.

        Args:
            name: Id of the lane or patch.
            chunk: Chunk of the reference.

        Returns:
            The reference; empty if the lane or patch, or its area, does not exist.
        """
        lane = self.lanes.get(name)
        tiles = self._lane_chunks(lane) if lane is not None else frozenset()
        if lane is None and name in self._patch_index:
            tiles = self.chunks_of_patch(name)
        if not tiles:
            return ""
        tile = chunk if chunk in tiles else min(tiles, key=lambda each: (each.x, each.y))
        return reference(piece_name(name, tiles, tile), "" if tile == chunk else tile.name)

    def neighbours(self, lane: LaneLine, chunk: Chunk) -> dict[str, tuple[str, ...]]:
        """References to the traffic spaces adjacent to a lane in a chunk, by role."""
        runs = self.runs(lane)
        places = [index for index, (tile, _) in enumerate(runs) if tile == chunk]
        references: dict[str, tuple[str, ...]] = {}
        if places:
            before, after = places[0], places[-1] + 1
            references["predecessor"] = (
                (self._reference(lane, runs[before - 1][0], chunk),)
                if before > 0
                else self._ends(lane.predecessors, -1, chunk)
            )
            references["successor"] = (
                (self._reference(lane, runs[after][0], chunk),)
                if after < len(runs)
                else self._ends(lane.successors, 0, chunk)
            )
        references["laneChangeLeft"] = self._beside(lane.left, chunk)
        references["laneChangeRight"] = self._beside(lane.right, chunk)
        return {role: ids for role, ids in references.items() if ids}

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


def piece_name(name: str, chunks: Set[Chunk], chunk: Chunk) -> str:
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
    tiles = tiles_of((points[1:] + points[:-1]) / 2)
    starts = np.flatnonzero(np.append(True, (np.diff(tiles, axis=0) != 0).any(axis=1)))
    ends = np.append(starts[1:], len(tiles))
    return [
        (Chunk(*tiles[first].tolist()), points[first : last + 1])
        for first, last in zip(starts.tolist(), ends.tolist(), strict=True)
    ]
