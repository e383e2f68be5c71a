"""Groups of lanelets as roads: which follow each other, and which lie in junctions."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.models.lanelet_map import LaneletMap
from envgen_usd.streets.lanelets.lane_groups import (
    LaneGroup,
    border_ends,
    border_points,
    group_area,
)

_LEAST_OVERLAP = 1.0
"""Least area in which two groups overlap in a junction, m²; larger: fewer junctions."""
_LEAST_SHARE = 0.03
"""The same as a share of the smaller group."""
_LEVELS = 2.5
"""Least height of a road over another that it does not meet, metres."""
_MOST_WAYS = 400
"""Largest number of ways of groups through a junction; larger: more overlapping roads."""


@dataclass(frozen=True)
class LaneEnd:
    """An end of a lane: number of the strip, 0 for its begin and 1 for its end, and of the lane."""

    strip: int
    end: int
    lane: int


@dataclass(frozen=True)
class RoadStrip:
    """Groups after each other that are a single road; outside of junctions, a single group.

    Attributes:
        groups: Groups along the road, with equal numbers of lanes.
        junction: Number of the junction that it leads through; -1 outside of junctions.
    """

    groups: tuple[LaneGroup, ...]
    junction: int = -1


@dataclass(frozen=True)
class RoadPlan:
    """All roads of a map.

    Attributes:
        strips: The roads.
        onward: End of a lane to the ends of lanes that it touches.
    """

    strips: tuple[RoadStrip, ...]
    onward: Mapping[LaneEnd, tuple[LaneEnd, ...]]


def road_plan(groups: Sequence[LaneGroup], source: LaneletMap) -> RoadPlan:
    """Finds junctions and joins groups that follow each other within a junction."""
    alone = [RoadStrip((group,)) for group in groups]
    onward = _onward(alone, source)
    sets = _Sets(len(groups))
    crossing = set(_unite_overlaps(groups, source, sets))
    crossing |= set(_unite_branches(alone, source, sets))
    _unite_at_ends(crossing, onward, sets)
    junction = {n: sets.of(n) for n in crossing}
    strips = list(_joined(groups, junction, onward))
    return RoadPlan(tuple(strips), _onward(strips, source))


class _Sets:
    """Disjoint sets of numbers."""

    def __init__(self, count: int) -> None:
        self._parent = list(range(count))

    def of(self, n: int) -> int:
        """Number that stands for the set of a number."""
        while self._parent[n] != n:
            self._parent[n] = self._parent[self._parent[n]]
            n = self._parent[n]
        return n

    def unite(self, n: int, m: int) -> None:
        """Joins the sets of two numbers."""
        low, high = sorted((self.of(n), self.of(m)))
        self._parent[high] = low


def lane_key(strip: RoadStrip, end: int, lane: int, source: LaneletMap) -> tuple[int, int]:
    """Places on the left and on the right of a lane's end for who leaves the strip there."""
    group = strip.groups[-end]
    left, right = (border_ends(source, group.borders[lane + k])[end] for k in (0, 1))
    return (left, right) if end else (right, left)


def _leaves_and_enters(strip: RoadStrip, end: int, lane: int, source: LaneletMap) -> set[str]:
    group = strip.groups[-end]
    if not source.lanelets[group.lanelets[lane]].one_way:
        return {"leaves", "enters"}
    return {"leaves"} if group.along[lane] == bool(end) else {"enters"}


def _ends(strips: Sequence[RoadStrip]) -> Iterator[LaneEnd]:
    for n, strip in enumerate(strips):
        for end in (0, 1):
            for lane in range(len(strip.groups[-end].lanelets)):
                yield LaneEnd(n, end, lane)


def _onward(strips: Sequence[RoadStrip], source: LaneletMap) -> dict[LaneEnd, tuple[LaneEnd, ...]]:
    """Ends of lanes that traffic leaves for each other."""
    at: dict[tuple[int, int], list[LaneEnd]] = defaultdict(list)
    for each in _ends(strips):
        at[lane_key(strips[each.strip], each.end, each.lane, source)].append(each)
    found = {}
    for (left, right), ends in at.items():
        if left == right:
            continue
        for here in ends:
            ways = _leaves_and_enters(strips[here.strip], here.end, here.lane, source)
            turn = {"leaves": "enters", "enters": "leaves"}
            wanted = {turn[way] for way in ways}
            others = tuple(
                there
                for there in at.get((right, left), ())
                if there.strip != here.strip or there.end != here.end
                if wanted & _leaves_and_enters(strips[there.strip], there.end, there.lane, source)
            )
            if others:
                found[here] = others
    return found


def _unite_overlaps(groups: Sequence[LaneGroup], source: LaneletMap, sets: _Sets) -> Iterator[int]:
    """Unites groups that overlap, and yields them."""
    numbers, areas = [], []
    for n, group in enumerate(groups):
        area = group_area(group, source)
        if area is not None and not area.is_empty:
            numbers.append(n)
            areas.append(area)
    shapes = np.array(areas, object)
    tree = shapely.STRtree(shapes)
    first, second = tree.query(shapes, predicate="intersects")
    first, second = first[first < second], second[first < second]
    shared = shapely.intersection(shapes[first], shapes[second])
    sizes = shapely.area(shapes)
    least = np.maximum(_LEAST_OVERLAP, _LEAST_SHARE * np.minimum(sizes[first], sizes[second]))
    for n, m, area, bound in zip(first, second, shared, least, strict=True):
        if shapely.area(area) < bound:
            continue
        middle = shapely.get_coordinates(shapely.centroid(area))[0]
        pair = numbers[n], numbers[m]
        heights = [_height(groups[k], source, middle) for k in pair]
        if abs(heights[0] - heights[1]) < _LEVELS:
            sets.unite(*pair)
            yield from pair


def _height(group: LaneGroup, source: LaneletMap, place: np.ndarray) -> float:
    points = np.concatenate([border_points(source, side) for side in group.borders])
    return float(points[np.argmin(np.hypot(*(points[:, :2] - place).T)), 2])


def _unite_branches(strips: Sequence[RoadStrip], source: LaneletMap, sets: _Sets) -> Iterator[int]:
    """Unites groups that begin or end with a lane at the same places, and yields them."""
    at: dict[tuple[int, int], set[int]] = defaultdict(set)
    for each in _ends(strips):
        at[lane_key(strips[each.strip], each.end, each.lane, source)].add(each.strip)
    for (left, right), numbers in at.items():
        if left != right and len(numbers) > 1:
            first, *others = sorted(numbers)
            for other in others:
                sets.unite(first, other)
            yield from numbers


def _unite_at_ends(
    crossing: set[int], onward: Mapping[LaneEnd, tuple[LaneEnd, ...]], sets: _Sets
) -> None:
    """Unites groups in junctions that touch each other or the same end of a road."""
    at: dict[tuple[int, int], list[int]] = defaultdict(list)
    for here, others in onward.items():
        met = [other.strip for other in others if other.strip in crossing]
        if here.strip in crossing:
            # Connecting roads lead from road to road, so junctions that touch are a single one.
            met.append(here.strip)
        at[here.strip, here.end] += met
    for numbers in at.values():
        for other in numbers[1:]:
            sets.unite(numbers[0], other)


def _joined(
    groups: Sequence[LaneGroup],
    junction: Mapping[int, int],
    onward: Mapping[LaneEnd, tuple[LaneEnd, ...]],
) -> Iterator[RoadStrip]:
    """Strips: groups outside of junctions, and each way of groups through a junction.

    A group that several ways share is a part of several connecting roads.
    """
    after: dict[int, list[int]] = defaultdict(list)
    for n, m in _successors(groups, junction, onward):
        after[n].append(m)
    has_before = {m for others in after.values() for m in others}
    ways: dict[int, list[tuple[int, ...]]] = defaultdict(list)
    for n in junction:
        if n not in has_before:
            ways[junction[n]] += _ways(n, after)
    for number in set(junction.values()):
        members = {n for n, of in junction.items() if of == number}
        met = {n for way in ways[number] for n in way}
        if len(ways[number]) > _MOST_WAYS:
            ways[number], met = [], set()
        ways[number] += [(n,) for n in sorted(members - met)]
    for n, group in enumerate(groups):
        if n not in junction:
            yield RoadStrip((group,))
    for number in sorted(ways):
        for way in ways[number]:
            yield RoadStrip(tuple(groups[n] for n in way), number)


def _ways(first: int, after: Mapping[int, Sequence[int]]) -> list[tuple[int, ...]]:
    """All ways on from a group that come to no group twice; none that only a ring goes on from."""
    found: list[tuple[int, ...]] = []
    stack: list[tuple[int, ...]] = [(first,)]
    while stack and len(found) <= _MOST_WAYS:
        way = stack.pop()
        onward = after.get(way[-1], ())
        stack += [(*way, m) for m in onward[::-1] if m not in way]
        if not onward:
            found.append(way)
    return found


def _successors(
    groups: Sequence[LaneGroup],
    junction: Mapping[int, int],
    onward: Mapping[LaneEnd, tuple[LaneEnd, ...]],
) -> Iterator[tuple[int, int]]:
    """Pairs of groups of a junction of which the second goes on from the first, lane by lane."""
    for n, group in enumerate(groups):
        if n not in junction:
            continue
        count = len(group.lanelets)
        others = [set(onward.get(LaneEnd(n, 1, k), ())) for k in range(count)]
        for m in sorted({end.strip for end in others[0] if end.end == 0}):
            other = groups[m]
            is_same = len(other.lanelets) == count and other.divider == group.divider and m != n
            if (
                m in junction
                and is_same
                and all(LaneEnd(m, 0, k) in others[k] for k in range(count))
            ):
                yield n, m
