"""Regions of a map: squares of chunks whose land is laid out by itself."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.geometry.square_index import Bounds, holds
from envgen_usd.models.array_types import BoolArray, FloatArray

SIDE = 5
"""Chunks along the side of a region; a larger value needs more memory, and less time in all."""
WHOLE = 7
"""Chunks along the side of a map that is a single region."""


@dataclass(frozen=True, order=True)
class Region:
    """A rectangle of chunks.

    Attributes:
        row: Row among the regions of the map, from the south.
        column: Column, from the west.
        first: Its south-western chunk.
        last: Its north-eastern chunk.
    """

    row: int
    column: int
    first: Chunk
    last: Chunk

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.column}_{self.row}"

    @property
    def bounds(self) -> Bounds:
        """(min x, min y, max x, max y), metres, road frame."""
        return (*self.first.bounds[:2], *self.last.bounds[2:])

    def around(self, margin: float) -> Bounds:
        """The rectangle with a margin, metres."""
        x0, y0, x1, y1 = self.bounds
        return x0 - margin, y0 - margin, x1 + margin, y1 + margin

    def holds(self, points: FloatArray) -> BoolArray:
        """Tells which points (N x 2) lie in the region; one on a border belongs to one region."""
        return holds(self.bounds, points)

    def has(self, chunk: Chunk) -> bool:
        """Tells whether a chunk belongs to the region."""
        (x0, y0), (x1, y1) = (self.first.x, self.first.y), (self.last.x, self.last.y)
        return x0 <= chunk.x <= x1 and y0 <= chunk.y <= y1


@dataclass(frozen=True)
class MapRegions:
    """The regions of a map, which follow from the boxes around its roads alone.

    Attributes:
        columns: Chunk numbers at which the columns begin, and the end of the last.
        rows: The same for the rows.
        boxes: Boxes around the roads, R x 4, metres.
        margin: Width of the land beside the road, metres.
    """

    columns: tuple[int, ...]
    rows: tuple[int, ...]
    boxes: FloatArray
    margin: float

    @staticmethod
    def of(boxes: FloatArray, margin: float) -> "MapRegions":
        """Divides a map.

        Args:
            boxes: Boxes around the roads, R x 4, metres.
            margin: Width of the land beside the road, metres.
        """
        low = np.floor((boxes[:, :2].min(axis=0) - margin) / CHUNK_SIZE).astype(int)
        high = np.floor((boxes[:, 2:].max(axis=0) + margin) / CHUNK_SIZE).astype(int) + 1
        columns, rows = (_edges(*side) for side in zip(low.tolist(), high.tolist(), strict=True))
        return MapRegions(columns, rows, boxes, margin)

    @cached_property
    def all(self) -> tuple[Region, ...]:
        """Regions with land beside a road, such that neighbours are near each other in the list."""
        found = [
            Region(row, column, Chunk(x0, y0), Chunk(x1 - 1, y1 - 1))
            for row, (y0, y1) in enumerate(zip(self.rows[:-1], self.rows[1:], strict=True))
            for column, (x0, x1) in enumerate(zip(self.columns[:-1], self.columns[1:], strict=True))
        ]
        return tuple(sorted(filter(self._has_land, found), key=_along_a_curve))

    @property
    def middle(self) -> FloatArray:
        """Middle of the map, 2, metres."""
        middle: FloatArray = (self.boxes[:, :2].min(axis=0) + self.boxes[:, 2:].max(axis=0)) / 2.0
        return middle

    @property
    def reach(self) -> float:
        """Distance of the farthest road from the middle, metres."""
        corners = self.boxes[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 2)
        return float(np.linalg.norm(corners - self.middle, axis=1).max())

    def number(self, region: Region) -> int:
        """Number of a region in the grid, from 0."""
        return region.row * (len(self.columns) - 1) + region.column

    def beside(self, region: Region) -> Iterator[Region]:
        """The region and those that touch it, from the south-west."""
        for row in range(region.row - 1, region.row + 2):
            for column in range(region.column - 1, region.column + 2):
                if (row, column) in self._by_place:
                    yield self._by_place[row, column]

    @cached_property
    def _by_place(self) -> dict[tuple[int, int], Region]:
        return {(region.row, region.column): region for region in self.all}

    def _has_land(self, region: Region) -> bool:
        x0, y0, x1, y1 = region.around(self.margin)
        low, high = self.boxes[:, :2], self.boxes[:, 2:]
        return bool(np.any(np.all((low <= (x1, y1)) & (high >= (x0, y0)), axis=1)))


def _edges(low: int, high: int) -> tuple[int, ...]:
    """Borders of equal parts of at most `SIDE` chunks, or of one part.

    The first and the last part have a chunk more: wide roads reach beyond their boxes.
    """
    count = 1 if high - low <= WHOLE else -(-(high - low) // SIDE)
    inner = (low + (high - low) * number // count for number in range(1, count))
    return (low - 1, *inner, high + 1)


def _along_a_curve(region: Region) -> int:
    """Place along a Z-order curve (Morton 1966), so that parts of the list are compact."""
    return sum(
        ((region.column >> bit & 1) << 2 * bit) | ((region.row >> bit & 1) << 2 * bit + 1)
        for bit in range(16)
    )
