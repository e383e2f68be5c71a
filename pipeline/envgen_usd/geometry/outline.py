"""The line along which the ground meets the road, with fast distance queries."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.models.arrays import BoolArray, FloatArray, IntArray
from envgen_usd.models.surface import RoadSurface

SAMPLE_SPACING = 0.5
"""Metres between the samples of an edge in the search tree."""
NEAREST_SAMPLES = (2, 8, 32)
"""Samples of which the edges are looked at, more and more for places that need it."""

Bounds = tuple[float, float, float, float]


@dataclass(frozen=True)
class Outline:
    """Edges of the road's level-0 outline; the road lies to the left of each.

    Attributes:
        start: E x 3, metres, road frame.
        end: E x 3.
    """

    start: FloatArray
    end: FloatArray

    @staticmethod
    def of(surface: RoadSurface) -> "Outline":
        """Edges of all loops of a surface, without those of no length in plan."""
        loops = [loop for loop in surface.outline if len(loop) > 1]
        if not loops:
            return Outline(np.empty((0, 3)), np.empty((0, 3)))
        start = surface.vertices[np.concatenate(loops)]
        end = surface.vertices[np.concatenate([np.roll(loop, -1) for loop in loops])]
        proper = np.any(start[:, :2] != end[:, :2], axis=1)
        return Outline(start[proper], end[proper])

    def __len__(self) -> int:
        """Number of edges."""
        return len(self.start)

    def near(self, bounds: Bounds, margin: float) -> "Outline":
        """The edges whose bounding box comes within a margin of a rectangle."""
        low = np.minimum(self.start, self.end)[:, :2] - margin
        high = np.maximum(self.start, self.end)[:, :2] + margin
        keep = np.all((low <= bounds[2:]) & (high >= bounds[:2]), axis=1)
        return Outline(self.start[keep], self.end[keep])

    def samples(self, spacing: float) -> tuple[FloatArray, IntArray]:
        """Points along all edges, both ends included, and the edge of each.

        Args:
            spacing: Largest distance in plan between neighbours on an edge, metres.

        Returns:
            S x 3 points; S indices of edges.
        """
        length = np.hypot(*(self.end - self.start)[:, :2].T)
        counts = np.ceil(length / spacing).astype(np.int64) + 1
        edge = np.repeat(np.arange(len(counts)), counts)
        place = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = (place / np.maximum(counts[edge] - 1, 1))[:, None]
        points: FloatArray = self.start[edge] * (1 - share) + self.end[edge] * share
        return points, edge

    def nearest(self, points: FloatArray, within: float = np.inf) -> tuple[FloatArray, FloatArray]:
        """The nearest place of the outline to each point.

        Args:
            points: N x 2 or N x 3; only x and y count.
            within: Distance in metres beyond which none is looked for, which is faster.

        Returns:
            Distance in plan, N (infinity where there is no outline within reach); the nearest
            place, N x 3 (zeros there).
        """
        distance, place = np.full(len(points), np.inf), np.zeros((len(points), 3))
        open_ = np.arange(len(points)) if len(self) else np.empty(0, dtype=np.int64)
        for count in NEAREST_SAMPLES:
            if not len(open_):
                break
            nearer = self._nearest_of_samples(points[open_, :2], within, count)
            distance[open_], place[open_], beyond = nearer
            # An edge whose samples are all farther than this cannot be nearer itself.
            enough = np.hypot(np.minimum(distance[open_], within), SAMPLE_SPACING / 2)
            open_ = open_[beyond < enough]
        return distance, place

    def _nearest_of_samples(
        self, plan: FloatArray, within: float, count: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance and place on the edges of the nearest samples; distance of the last of those."""
        distance, place = np.full(len(plan), np.inf), np.zeros((len(plan), 3))
        tree, edge_of_sample = self._tree
        reach = within + SAMPLE_SPACING
        near = tree.query(np.ascontiguousarray(plan), count, distance_upper_bound=reach)
        far, sample = np.asarray(near[0]), np.asarray(near[1])
        known = np.append(edge_of_sample, -1)
        edges = known[sample]
        for number in range(count):
            index = np.flatnonzero(edges[:, number] >= 0)
            if number:
                index = index[edges[index, number] != edges[index, number - 1]]
            foot = self._foot(plan[index], edges[index, number])
            length = np.hypot(*(foot[:, :2] - plan[index]).T)
            nearer = (length < distance[index]) & (length <= within)
            distance[index[nearer]], place[index[nearer]] = length[nearer], foot[nearer]
        return distance, place, far[:, -1]

    def encloses(self, points: FloatArray) -> BoolArray:
        """Whether each of a few points (N x 2) is on the road: even-odd count of crossings."""
        inside = np.zeros(len(points), dtype=np.bool_)
        if not len(points):
            return inside
        (x_min, y_min), y_max = points.min(axis=0), points[:, 1].max()
        right = self.near((x_min, y_min, np.inf, y_max), 0.0)
        low = np.minimum(right.start, right.end)[:, 1]
        high = np.maximum(right.start, right.end)[:, 1]
        for number, (x, y) in enumerate(points):
            hit = (low <= y) & (high > y)
            start, end = right.start[hit], right.end[hit]
            share = (y - start[:, 1]) / (end[:, 1] - start[:, 1])
            inside[number] = np.sum(start[:, 0] + share * (end - start)[:, 0] > x) % 2
        return inside

    def encloses_grid(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Whether the points of a grid are on the road, len(y) x len(x), both axes ascending."""
        right = self.near((x[0], y[0], np.inf, y[-1]), 0.0)
        low, high = np.sort(np.stack([right.start[:, 1], right.end[:, 1]]), axis=0)
        first, last = np.searchsorted(y, low), np.searchsorted(y, high)
        edge = np.repeat(np.arange(len(first)), last - first)
        row = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - last, last - first)
        start, end = right.start[edge], right.end[edge]
        share = (y[row] - start[:, 1]) / (end[:, 1] - start[:, 1])
        crossing = start[:, 0] + share * (end[:, 0] - start[:, 0])
        # A crossing turns all points to its left around.
        turns = np.zeros((len(y), len(x) + 1), dtype=np.int64)
        np.add.at(turns, (row, np.searchsorted(x, crossing)), 1)
        to_the_right = np.cumsum(turns[:, ::-1], axis=1)[:, ::-1]
        on_road: BoolArray = to_the_right[:, 1:] % 2 == 1
        return on_road

    @cached_property
    def _tree(self) -> tuple[cKDTree, IntArray]:
        points, edge = self.samples(SAMPLE_SPACING)
        return cKDTree(points[:, :2]), edge

    def _foot(self, plan: FloatArray, edge: IntArray) -> FloatArray:
        start, along = self.start[edge], self.end[edge] - self.start[edge]
        square = np.sum(along[:, :2] ** 2, axis=1)
        share = np.sum((plan - start[:, :2]) * along[:, :2], axis=1) / square
        foot: FloatArray = start + np.clip(share, 0.0, 1.0)[:, None] * along
        return foot
