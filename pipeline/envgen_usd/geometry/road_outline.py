"""Outline of the road, where the ground meets it, with fast distance queries."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.geometry.square_index import SIDE, Bounds, SquareIndex
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.road_surface import RoadSurface

SAMPLE_SPACING = 0.5
"""Metres between samples of an edge in the search tree; a smaller value costs memory."""
NEAREST_SAMPLES = (2, 8, 32)
"""Numbers of nearest samples whose edges are tested; a point uses the next if necessary."""


@dataclass(frozen=True)
class Outline:
    """Edges of the road's level-0 outline; the road lies to the left of each.

    The first query builds an index of all edges. The time of a query grows with the edges near
    its place.

    Attributes:
        start: E x 3, metres, road frame.
        end: E x 3.
    """

    start: FloatArray
    end: FloatArray

    @staticmethod
    def of(surface: RoadSurface) -> "Outline":
        """Creates the edges of all loops of a surface, except edges without length in plan."""
        loops = [loop for loop in surface.outline if len(loop) > 1]
        if not loops:
            return Outline(np.empty((0, 3)), np.empty((0, 3)))
        start = surface.vertices[np.concatenate(loops)]
        end = surface.vertices[np.concatenate([np.roll(loop, -1) for loop in loops])]
        proper = np.any(start[:, :2] != end[:, :2], axis=1)
        return Outline(start[proper], end[proper])

    def __len__(self) -> int:
        """Returns the number of edges."""
        return len(self.start)

    def near(self, bounds: Bounds, margin: float) -> "Outline":
        """Returns the edges with a bounding box within a margin (metres) of a rectangle."""
        rows = self._index.near(bounds, margin)
        start, end = self.start[rows], self.end[rows]
        low = np.minimum(start, end)[:, :2] - margin
        high = np.maximum(start, end)[:, :2] + margin
        keep = np.all((low <= bounds[2:]) & (high >= bounds[:2]), axis=1)
        return Outline(start[keep], end[keep])

    def samples(self, spacing: float) -> tuple[FloatArray, IntArray]:
        """Returns points along all edges, including both ends, and the edge of each point.

        Args:
            spacing: Largest distance in plan between neighbouring points of an edge, metres.

        Returns:
            S x 3 points, metres; S indices of edges.
        """
        length = np.hypot(*(self.end - self.start)[:, :2].T)
        counts = np.ceil(length / spacing).astype(np.int64) + 1
        edge = np.repeat(np.arange(len(counts)), counts)
        place = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = (place / np.maximum(counts[edge] - 1, 1))[:, None]
        points: FloatArray = self.start[edge] * (1 - share) + self.end[edge] * share
        return points, edge

    def nearest(self, points: FloatArray, within: float = np.inf) -> tuple[FloatArray, FloatArray]:
        """Returns the nearest point of the outline to each point.

        Args:
            points: N x 2 or N x 3, metres; only x and y count.
            within: Search radius in metres; a smaller value is faster.

        Returns:
            Distance in plan, N, metres; infinity beyond the radius. Nearest point, N x 3, metres;
            zeros beyond the radius.
        """
        distance, place = np.full(len(points), np.inf), np.zeros((len(points), 3))
        open_ = np.arange(len(points)) if len(self) else np.empty(0, dtype=np.int64)
        for count in NEAREST_SAMPLES:
            if not len(open_):
                break
            nearer = self._nearest_of_samples(points[open_, :2], within, count)
            distance[open_], place[open_], beyond = nearer
            # An edge with all samples beyond this distance cannot be nearer.
            enough = np.hypot(np.minimum(distance[open_], within), SAMPLE_SPACING / 2)
            open_ = open_[beyond < enough]
        return distance, place

    def _nearest_of_samples(
        self, plan: FloatArray, within: float, count: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns distance and point on the edges of the nearest samples, and the last distance."""
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
        """Returns whether each of a few points (N x 2) is on the road, by even-odd crossings.

        The edges have to form whole loops.
        """
        inside = np.zeros(len(points), dtype=np.bool_)
        if not len(points):
            return inside
        (x_min, y_min), (x_max, y_max) = points.min(axis=0), points.max(axis=0)
        right, beyond = self._to_the_right((x_min, y_min, x_max, y_max))
        low = np.minimum(right.start, right.end)[:, 1]
        high = np.maximum(right.start, right.end)[:, 1]
        farther = np.searchsorted(beyond, points[:, 1], side="right")
        for number, (x, y) in enumerate(points):
            hit = (low <= y) & (high > y)
            start, end = right.start[hit], right.end[hit]
            share = (y - start[:, 1]) / (end[:, 1] - start[:, 1])
            crossed = np.sum(start[:, 0] + share * (end - start)[:, 0] > x)
            inside[number] = (crossed + farther[number]) % 2
        return inside

    def encloses_grid(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Returns whether grid points are on the road, len(y) x len(x), both axes ascending.

        The edges have to form whole loops.
        """
        right, beyond = self._to_the_right((x[0], y[0], x[-1], y[-1]))
        low, high = np.sort(np.stack([right.start[:, 1], right.end[:, 1]]), axis=0)
        first, last = np.searchsorted(y, low), np.searchsorted(y, high)
        edge = np.repeat(np.arange(len(first)), last - first)
        row = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - last, last - first)
        start, end = right.start[edge], right.end[edge]
        share = (y[row] - start[:, 1]) / (end[:, 1] - start[:, 1])
        crossing = start[:, 0] + share * (end[:, 0] - start[:, 0])
        # A crossing inverts all points to its left.
        turns = np.zeros((len(y), len(x) + 1), dtype=np.int64)
        np.add.at(turns, (row, np.searchsorted(x, crossing)), 1)
        turns[:, -1] += np.searchsorted(beyond, y, side="right")
        to_the_right = np.cumsum(turns[:, ::-1], axis=1)[:, ::-1]
        on_road: BoolArray = to_the_right[:, 1:] % 2 == 1
        return on_road

    def _to_the_right(self, bounds: Bounds) -> tuple["Outline", FloatArray]:
        """What decides how often rays to the right from places in a rectangle cross the outline.

        An upright line of the index lies to the right of the rectangle. The outline is closed, so
        heights stand for the edges beyond that line: a ray at y crosses an even number of them
        if an even number of the heights is at most y.

        Returns:
            The edges that begin left of the line, and the heights, ascending.
        """
        line = int(bounds[2] // SIDE) + 1
        near = self.near((*bounds[:2], line * SIDE, bounds[3]), 0.0)
        lines, heights = self._passages
        first, last = np.searchsorted(lines, [line, line + 1])
        return near, heights[first:last]

    @cached_property
    def _index(self) -> SquareIndex:
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        return SquareIndex.of(low[:, :2], high[:, :2])

    @cached_property
    def _passages(self) -> tuple[IntArray, FloatArray]:
        """Upright lines of the index that edges cross, and the heights of those edges' right ends.

        The edges beyond a line are chains. Each end of a chain is the right end of an edge that
        crosses or touches the line. Between the heights of these ends, a ray meets the chain an
        odd number of times.
        """
        turned = self.start[:, 0] > self.end[:, 0]
        left = np.where(turned[:, None], self.end, self.start)
        right = np.where(turned[:, None], self.start, self.end)
        first, last = (np.floor(side[:, 0] / SIDE).astype(np.int64) for side in (left, right))
        counts = last - first + 1
        edge = np.repeat(np.arange(len(counts)), counts)
        line = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
        crossed = (left[edge, 0] <= line * SIDE) & (line * SIDE < right[edge, 0])
        lines, heights = line[crossed], right[edge[crossed], 1]
        order = np.lexsort((heights, lines))
        return lines[order], heights[order]

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
