"""Lanes into the land behind the plots at the street, and the rows of plots along them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from envgen_usd.landuse.blocks.land_areas import common, union
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
_TRIED_ENTRIES = 30
"""Tried lanes from the street to inner land."""
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

    def into(self, land: shapely.Polygon, block: shapely.Geometry) -> list[Entry]:
        """Lanes into land, at most `_TRIED_ENTRIES`; first those that cost plots the least.

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
        best = np.argsort(cost, kind="stable")[:_TRIED_ENTRIES]
        return [
            Entry(
                lanes[number],
                self._starts[close[number]] + away[number] * self._normals[close[number]],
                self._normals[close[number]],
            )
            for number in best[np.isfinite(cost[best])].tolist()
        ]

    def use(self, entry: Entry) -> None:
        """Keeps other lanes from crossing a lane."""
        self._used.append(entry.shape)

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
    3. Other land gets lanes at equal distances, such that plots are no deeper than the rules', and
       a link across them near the entry.

    Args:
        land: Inner land in its frame.
        entry: 2, where the lane from the street meets it in its frame, metres.
        rules: Sizes of plots.

    Returns:
        Rows; and lanes, not yet cut to the land.
    """
    u0, v0, u1, v1 = land.bounds
    width, least = v1 - v0, least_row(rules)
    if width < least:
        return [], []
    if width < 2.0 * least - LANE:
        below = entry[1] < (v0 + v1) / 2.0
        middles = [v0 + LANE / 2.0 if below else v1 - LANE / 2.0]
        rows = [
            Row(v0 + LANE, v1, lane_below=True) if below else Row(v0, v1 - LANE, lane_below=False)
        ]
    else:
        count = math.ceil(width / (2.0 * rules.depth[1] + LANE))
        pitch = width / count
        middles = [v0 + (number + 0.5) * pitch for number in range(count)]
        rows = [row for middle in middles for row in _beside(middle, pitch)]
    lines = [shapely.LineString([(u0, v), (u1, v)]) for v in middles]
    if len(middles) > 1:
        lines.append(_link(land, float(entry[0]), (middles[0], middles[-1])))
    return rows, list(shapely.buffer(lines, LANE / 2.0, cap_style="square"))


def connected_lanes(
    land: shapely.Polygon, lanes: Sequence[shapely.Polygon], entry: FloatArray, way: shapely.Polygon
) -> shapely.Polygon:
    """The lanes inside of land that the lane from the street leads to.

    Bays and necks of the land cut lanes in parts. The way leads straight on to the part ahead of
    it, or to the nearest; further parts are joined where a straight way on the land leads to them.

    Args:
        land: Inner land in its frame.
        lanes: Lanes as `rows_of` returns them.
        entry: 2 x 2, where the way meets the land, metres, and its direction.
        way: The lane from the street.
    """
    parts = list(shapely.get_parts(common(union(lanes), land)))
    around = shapely.buffer(land, LANE / 2.0)
    shapely.prepare(around)
    network = way
    while parts:
        whole = shapely.multipolygons(parts)
        tried = [shapely.shortest_line(network, part) for part in parts]
        if network is way and (ahead := _straight_on(entry, whole)) is not None:
            tried = [ahead, *tried]
        fits = [line for line in tried if around.covers(line)]
        if not fits:
            break
        line = fits[0] if network is way else min(fits, key=shapely.length)
        joint = shapely.buffer(line, LANE / 2.0, cap_style="square") if line.length > 0.0 else line
        reached = [part for part in parts if part.intersects(joint)]
        parts = [part for part in parts if not part.intersects(joint)]
        joined = shapely.get_parts(union([network, joint, *reached]))
        network = joined[int(np.argmax(shapely.area(joined)))]
        if not reached:
            break
    return network


def _straight_on(entry: FloatArray, lanes: shapely.Geometry) -> shapely.LineString | None:
    """The line straight on from an entry (2 x 2) to the lane ahead; `None` without any."""
    ray = shapely.LineString([entry[0], entry[0] + _REACH * entry[1]])
    hit = shapely.intersection(ray, lanes)
    if hit.is_empty:
        return None
    away = shapely.distance(shapely.Point(entry[0]), hit)
    return shapely.LineString([entry[0], entry[0] + (away + LANE / 2.0) * entry[1]])


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
