"""Lanes into the land behind the plots at the street, and the rows of plots along them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.land_rules import PlotRules

LANE = 4.0
"""Width of a lane inside of a block, metres; a larger value widens lanes."""
LEAST_DEPTH = 0.5
"""Least depth of an inner plot, as a share of the rules' least depth.

A larger value leaves more narrow inner land without houses.
"""
MOST_LOSS = 0.4
"""Largest share of its land that a plot loses to a lane; a larger value reaches more land."""
LENGTH_COST = 0.003
"""What a metre of a lane costs, in shares of a plot; a larger value prefers shorter lanes."""
_REACH = 150.0
"""Longest lane from the street to inner land, metres."""
_TRIED = 41
"""Tried places of the link between lanes."""
_INTO = 1.0
"""Length of the lane from the street inside of the land that it leads to, metres."""


@dataclass(frozen=True)
class Entry:
    """A lane from the street to inner land, along the side between two plots.

    Attributes:
        shape: Polygon, metres.
        place: 2, where it meets the land.
        direction: 2, unit vector from the street to the land.
    """

    shape: shapely.Polygon
    place: FloatArray
    direction: FloatArray


@dataclass(frozen=True)
class Row:
    """A row of plots along a lane, in the frame of its land.

    Attributes:
        low: Its lower border, metres.
        high: Its upper border, metres.
        lane_below: True if the lane lies at the lower border.
    """

    low: float
    high: float
    lane_below: bool

    @property
    def front(self) -> float:
        """The border at the lane, metres."""
        return self.low if self.lane_below else self.high


@dataclass(frozen=True)
class Frame:
    """Axes of a piece of land, along its longer and its shorter side.

    Attributes:
        axes: 2 x 2, unit vectors as rows, right-handed.
    """

    axes: FloatArray

    @staticmethod
    def of(land: shapely.Polygon) -> "Frame":
        """Axes along most of the sides of land: sides at right angles have the same axes."""
        sides = np.diff(shapely.get_coordinates(land.exterior), axis=0) @ np.array([1.0, 1.0j])
        lengths = np.maximum(np.abs(sides), 1e-9)
        angle = float(np.angle(np.sum(lengths * (sides / lengths) ** 4))) / 4.0
        along = np.array([np.cos(angle), np.sin(angle)])
        axes = np.stack([along, [-along[1], along[0]]])
        long, short = np.ptp(shapely.get_coordinates(land) @ axes.T, axis=0).tolist()
        return Frame(axes if long >= short else np.stack([axes[1], -axes[0]]))

    def to_local(self, shape: shapely.Geometry) -> shapely.Geometry:
        """A shape in this frame."""
        return shapely.transform(shape, lambda points: points @ self.axes.T)

    def to_map(self, shape: shapely.Geometry) -> shapely.Geometry:
        """A shape of this frame on the map."""
        return shapely.transform(shape, lambda points: points @ self.axes)


class Entries:
    """Finds lanes into the land behind plots."""

    def __init__(self, sites: Sites, shapes: Sequence[shapely.Polygon]) -> None:
        """Takes the sites, and all plots at the street.

        Args:
            sites: Sites of plots; lanes run along their sides.
            shapes: All plots at the street, with the land that they were given.
        """
        first = sites.rows == 0
        out = (sites.before[first, None, None] + 1.0) * sites.normals[first]
        self._starts = (sites.fronts[first] - out).reshape(-1, 2)
        self._normals = sites.normals[first].reshape(-1, 2)
        self._skip = np.repeat(sites.before[first] + 1.5, 2)
        self._shapes = np.array(shapes, object)
        self._tree = shapely.STRtree(self._shapes)
        self._used: list[shapely.Polygon] = []

    def into(self, land: shapely.Polygon, block: shapely.Geometry) -> Entry | None:
        """The lane into land that costs plots the least; `None` without any.

        Args:
            land: Inner land.
            block: The block that holds it; a lane crosses no other road.
        """
        close = np.flatnonzero(shapely.dwithin(shapely.points(self._starts), land, _REACH))
        ends = self._starts[close] + _REACH * self._normals[close]
        rays = shapely.linestrings(np.stack([self._starts[close], ends], axis=1))
        hits = shapely.intersection(rays, land)
        close, hits = close[~shapely.is_empty(hits)], hits[~shapely.is_empty(hits)]
        away = shapely.distance(shapely.points(self._starts[close]), hits)
        lines = self._lines(close, 0.0, away + _INTO)
        # The start of a lane lies on its street; the rest must stay in the block.
        clear = shapely.covers(block, self._lines(close, self._skip[close], away))
        lanes = shapely.buffer(lines, LANE / 2.0, cap_style="flat")
        cost = self._cost(lanes) + LENGTH_COST * away
        cost[~clear | (away <= 0.0)] = np.inf
        if not np.isfinite(cost).any():
            return None
        best = int(np.argmin(cost))
        self._used.append(lanes[best])
        number = close[best]
        place = self._starts[number] + away[best] * self._normals[number]
        return Entry(lanes[best], place, self._normals[number])

    def _lines(
        self, numbers: IntArray, start: FloatArray | float, end: FloatArray
    ) -> NDArray[np.object_]:
        """Lines from one distance behind the street to another, metres."""
        share = np.stack([np.broadcast_to(start, end.shape), end], axis=1)[..., None]
        points = self._starts[numbers, None] + share * self._normals[numbers, None]
        lines: NDArray[np.object_] = shapely.linestrings(points)
        return lines

    def _cost(self, lanes: NDArray[np.object_]) -> FloatArray:
        """Largest share of its land that a plot loses to each lane; infinite if too large."""
        lane, plot = self._tree.query(lanes, "intersects")
        lost = shapely.area(shapely.intersection(lanes[lane], self._shapes[plot]))
        cost = np.zeros(len(lanes))
        np.maximum.at(cost, lane, lost / shapely.area(self._shapes[plot]))
        cost[cost > MOST_LOSS] = np.inf
        for used in self._used:
            cost[shapely.intersects(lanes, used)] = np.inf
        return cost


def least_row(rules: PlotRules) -> float:
    """Least width of land with a lane and a row of plots, metres."""
    return LEAST_DEPTH * rules.depth[0] + LANE


def rows_of(
    land: shapely.Polygon, entry: FloatArray, rules: PlotRules
) -> tuple[list[Row], list[shapely.Polygon]]:
    """Lays lanes along the longer side of inner land.

    1. Land too narrow for a lane and a plot gets no rows.
    2. Land too narrow for two rows gets a lane along the side of the entry.
    3. Other land gets lanes at equal distances, such that plots are no deeper than the rules'.

    Args:
        land: Inner land in its frame.
        entry: 2 x 2, where the lane from the street meets it, metres, and the lane's direction, in
            its frame.
        rules: Sizes of plots.

    Returns:
        Rows; and lanes with the link between them and the entry, not yet cut to the land.
    """
    u0, v0, u1, v1 = land.bounds
    width, least = v1 - v0, least_row(rules)
    if width < least:
        return [], []
    if width < 2.0 * least - LANE:
        below = entry[0, 1] < (v0 + v1) / 2.0
        middles = [v0 + LANE / 2.0 if below else v1 - LANE / 2.0]
        rows = [
            Row(v0 + LANE, v1, lane_below=True) if below else Row(v0, v1 - LANE, lane_below=False)
        ]
    else:
        count = math.ceil(width / (2.0 * rules.depth[1] + LANE))
        pitch = width / count
        middles = [v0 + (number + 0.5) * pitch for number in range(count)]
        rows = [row for middle in middles for row in _beside(middle, pitch)]
    lanes = [shapely.LineString([(u0, v), (u1, v)]) for v in middles]
    lines = [*lanes, *_links(land, entry, middles)]
    return rows, list(shapely.buffer(lines, LANE / 2.0, cap_style="square"))


def _links(
    land: shapely.Polygon, entry: FloatArray, middles: Sequence[float]
) -> Iterator[shapely.LineString]:
    """A line straight on from the entry, and one across all lanes."""
    (u, v), (along, across) = entry.tolist()
    low, high = min(middles), max(middles)
    if abs(across) > abs(along):
        yield shapely.LineString([(u, v), (u, low if across > 0.0 else high)])
    else:
        low, high = min(v, low), max(v, high)
    link = _link(land, u, (low, high))
    yield link
    if abs(across) <= abs(along):
        yield shapely.LineString([(u, v), (link.coords[0][0], v)])


def _link(land: shapely.Polygon, near: float, ends: tuple[float, float]) -> shapely.LineString:
    """A line across all lanes that leaves the land the least, as near to the entry as possible."""
    u0, _, u1, _ = land.bounds
    room = LANE / 2.0
    places = np.append(np.linspace(u0 + room, u1 - room, _TRIED), near)
    low, high = np.broadcast_arrays(ends[0], ends[1] + 0.1, places)[:2]
    points = np.stack([np.stack([places, low], axis=1), np.stack([places, high], axis=1)], axis=1)
    lines = shapely.linestrings(points)
    outside = shapely.length(shapely.difference(lines, land))
    return lines[int(np.lexsort((np.abs(places - near), np.round(outside)))[0])]


def _beside(middle: float, pitch: float) -> Iterator[Row]:
    yield Row(middle - pitch / 2.0, middle - LANE / 2.0, lane_below=False)
    yield Row(middle + LANE / 2.0, middle + pitch / 2.0, lane_below=True)
