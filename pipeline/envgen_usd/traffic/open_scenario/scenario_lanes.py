"""Lanes as a map: places on them, what follows, what lies beside, and ways along them."""

import heapq
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanes import DRIVEN
from envgen_usd.models.road_surface import LaneLine, RoadLine

_TURNED = 200.0
"""Metres by which a lane in the other direction counts as farther away."""
_CHANGE = 30.0
"""Metres that a lane change costs on the way to a place; larger values avoid changes."""


@dataclass(frozen=True, eq=False)
class LanePlace:
    """A place on a lane.

    Attributes:
        lane: The lane.
        along: Metres from its begin, in the direction of travel.
        offset: Metres to the left of its centre line, in the direction of travel.
    """

    lane: LaneLine
    along: float
    offset: float = 0.0


class LanePath:
    """Centre lines of lanes that follow one another."""

    def __init__(self, lanes: Sequence[LaneLine], start: float, *, reverse: bool = False) -> None:
        """Takes the lanes, and the metres of the first before the path; reverse drives back."""
        self.lanes = tuple(lanes)
        lines = [lane.points[::-1] if reverse else lane.points for lane in lanes]
        points = np.concatenate([line[:, :2] for line in lines])
        heights = np.concatenate([line[:, 2] for line in lines])
        step = np.linalg.norm(np.diff(points, axis=0), axis=1)
        kept = np.concatenate([[True], step > 1e-6])
        self._points, self._heights = points[kept], heights[kept]
        lengths = np.linalg.norm(np.diff(self._points, axis=0), axis=1)
        self._along = np.concatenate([[0.0], np.cumsum(lengths)]) - start
        sizes = np.cumsum([len(line) for line in lines])[:-1]
        where = np.cumsum(np.concatenate([[0.0], step])) - start
        self._starts = (
            np.concatenate([[-start], where[sizes]]) if len(sizes) else np.array([-start])
        )
        chords = np.diff(self._points, axis=0)
        self._headings = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))

    @property
    def length(self) -> float:
        """Metres from its begin to its end."""
        return float(self._along[-1])

    def lane_at(self, along: float) -> tuple[LaneLine, float]:
        """Returns the lane at a way along the path, and the metres since that lane's begin."""
        place = max(int(np.searchsorted(self._starts, along, side="right")) - 1, 0)
        return self.lanes[place], along - float(self._starts[place])

    def pose(self, along: float, offset: float) -> tuple[float, float, float, float]:
        """Returns x, y, z (metres) and heading (radians) beside the path."""
        heading = self._heading(along)
        x = float(np.interp(along, self._along, self._points[:, 0]))
        y = float(np.interp(along, self._along, self._points[:, 1]))
        z = float(np.interp(along, self._along, self._heights))
        return x - offset * np.sin(heading), y + offset * np.cos(heading), z, heading

    def _heading(self, along: float) -> float:
        """Heading, continuous over the corners of the line."""
        middles = (self._along[1:] + self._along[:-1]) / 2
        return float(np.interp(along, middles, self._headings))


class LaneMap:
    """All lanes of a map."""

    def __init__(self, lanes: Iterable[LaneLine], roads: Iterable[RoadLine]) -> None:
        """Takes the lanes and the reference lines."""
        self.lanes = {lane.id: lane for lane in lanes if len(lane.points) > 1}
        self._roads = {road.road: road for road in roads}
        self._s: dict[str, FloatArray] = {}
        self._before: dict[str, list[str]] = {name: [] for name in self.lanes}
        for lane in self.lanes.values():
            for after in lane.successors:
                if after in self._before:
                    self._before[after].append(lane.id)

    def road_point(self, road: str, s: float, t: float) -> tuple[float, float, float, float] | None:
        """Returns x, y, z and heading of a place on a road; `None` for unknown roads."""
        line = self._roads.get(road)
        if line is None:
            return None
        heading = float(np.interp(s, line.s, np.unwrap(line.heading)))
        x, y, z = (float(np.interp(s, line.s, line.points[:, axis])) for axis in range(3))
        return x - t * np.sin(heading), y + t * np.cos(heading), z, heading

    def at(self, road: str, lane: int, s: float) -> LanePlace | None:
        """Returns the place of a lane at a position along its road; `None` for unknown lanes."""
        found = [each for each in self.lanes.values() if each.road == road and each.lane == lane]
        if not found:
            return None

        def miss(line: LaneLine) -> float:
            stations = self.stations(line)
            return max(float(stations.min()) - s, s - float(stations.max()), 0.0)

        line = min(found, key=miss)
        stations, along = self.stations(line), _lengths(line.points)
        order = np.argsort(stations, kind="stable")
        return LanePlace(line, float(np.interp(s, stations[order], along[order])))

    def stations(self, line: LaneLine) -> FloatArray:
        """Returns s along the road of each point of a lane, metres."""
        if line.id not in self._s:
            road = self._roads[line.road]
            self._s[line.id] = _projected(line.points[:, :2], road)
        return self._s[line.id]

    def follows_s(self, line: LaneLine) -> bool:
        """True if a lane's traffic runs with increasing s."""
        stations = self.stations(line)
        return bool(stations[-1] >= stations[0])

    @cached_property
    def _segments(self) -> tuple[FloatArray, FloatArray, list[LaneLine], FloatArray]:
        """Begin and end of all pieces of lanes for vehicles, their lane, and the way before."""
        lines = [lane for lane in self.lanes.values() if lane.lane_type in DRIVEN]
        lines = lines or list(self.lanes.values())
        starts = np.concatenate([line.points[:-1, :2] for line in lines])
        ends = np.concatenate([line.points[1:, :2] for line in lines])
        owners = [line for line in lines for _ in range(len(line.points) - 1)]
        before = np.concatenate([_lengths(line.points)[:-1] for line in lines])
        return starts, ends, owners, before

    def nearest(self, x: float, y: float, heading: float | None = None) -> LanePlace | None:
        """Returns the place on the nearest lane; lanes of the other direction count as farther."""
        if not self.lanes:
            return None
        starts, ends, owners, before = self._segments
        chord = ends - starts
        size = np.maximum((chord**2).sum(axis=1), 1e-12)
        apart = np.array([x, y]) - starts
        share = np.clip((apart * chord).sum(axis=1) / size, 0.0, 1.0)
        away = np.linalg.norm(apart - share[:, None] * chord, axis=1)
        if heading is not None:
            ahead = np.array([np.cos(heading), np.sin(heading)])
            away = away + _TURNED * (chord @ ahead < 0.0)
        best = int(away.argmin())
        length = np.sqrt(size[best])
        left = (chord[best, 0] * apart[best, 1] - chord[best, 1] * apart[best, 0]) / length
        return LanePlace(owners[best], float(before[best] + share[best] * length), float(left))

    def beside(self, place: LanePlace, left: int) -> LanePlace | None:
        """Returns the place some lanes to the left in the direction of travel, or `None`."""
        line = place.lane
        step = left if self.follows_s(line) else -left
        s = float(np.interp(place.along, _lengths(line.points), self.stations(line)))
        return self.at(line.road, shifted_lane(line.lane, step), s)

    def s_of(self, place: LanePlace) -> float:
        """Returns the position of a place along its road, metres."""
        return float(np.interp(place.along, _lengths(place.lane.points), self.stations(place.lane)))

    def path(
        self,
        place: LanePlace,
        reach: float,
        targets: Sequence[LanePlace] = (),
        *,
        back: bool = False,
    ) -> LanePath:
        """Returns the way ahead of a place: by the targets, else straight on.

        Args:
            place: Where it begins.
            reach: Metres after which it may end.
            targets: Places to pass in order.
            back: Drive against the direction of travel.
        """
        chain = [place.lane]
        begin = _length(place.lane) - place.along if back else place.along
        total = _length(place.lane) - begin
        ahead = [target for target in targets if target.lane.id != place.lane.id]
        costs = self._costs(ahead[0].lane.id) if ahead else {}
        while total < reach:
            if ahead and chain[-1].id == ahead[0].lane.id:
                ahead = ahead[1:]
                costs = self._costs(ahead[0].lane.id) if ahead else {}
            names = self._before[chain[-1].id] if back else chain[-1].successors
            following = [self.lanes[name] for name in names if name in self.lanes]
            if not following:
                break
            chain.append(_best(chain[-1], following, costs, back=back))
            total += _length(chain[-1])
        return LanePath(chain, begin, reverse=back)

    def _costs(self, target: str) -> dict[str, float]:
        """Metres from the end of each lane to a lane (Dijkstra 1959, from the target back)."""
        costs: dict[str, float] = {}
        queue = [(0.0, target)]
        while queue:
            cost, name = heapq.heappop(queue)
            if name in costs:
                continue
            costs[name] = cost
            lane = self.lanes[name]
            for other in self._before[name]:
                heapq.heappush(queue, (cost + _length(lane), other))
            for other in (lane.left, lane.right):
                if other in self.lanes and name in {
                    self.lanes[other].left,
                    self.lanes[other].right,
                }:
                    heapq.heappush(queue, (cost + _CHANGE, other))
        return costs


def _best(
    lane: LaneLine, following: Sequence[LaneLine], costs: dict[str, float], *, back: bool
) -> LaneLine:
    """The next lane: the one on the way, else the straightest."""
    on_way = [each for each in following if each.id in costs]
    if on_way:
        return min(on_way, key=lambda each: costs[each.id] + _length(each))

    def turn(each: LaneLine) -> float:
        first, second = (each, lane) if back else (lane, each)
        one = first.points[-1, :2] - first.points[-2, :2]
        other = second.points[-1, :2] - second.points[0, :2]
        return abs(float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other)))

    return min(following, key=turn)


def shifted_lane(lane: int, step: int) -> int:
    """Returns the id of a lane some ids away; the centre lane 0 does not count."""
    shifted = lane + step
    if lane * shifted <= 0 and step:
        shifted += 1 if step > 0 else -1
    return shifted


def _lengths(points: FloatArray) -> FloatArray:
    step = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(step)])


def _length(line: LaneLine) -> float:
    return float(_lengths(line.points)[-1])


def _projected(points: FloatArray, road: RoadLine) -> FloatArray:
    """Positions along a road of the nearest places on its reference line, N, metres."""
    starts, chord = road.points[:-1, :2], np.diff(road.points[:, :2], axis=0)
    size = np.maximum((chord**2).sum(axis=1), 1e-12)
    apart = points[:, None] - starts
    share = np.clip((apart * chord).sum(axis=2) / size, 0.0, 1.0)
    away = ((apart - share[..., None] * chord) ** 2).sum(axis=2)
    nearest = away.argmin(axis=1)
    rows = np.arange(len(points))
    step = np.diff(road.s)
    found: FloatArray = road.s[nearest] + share[rows, nearest] * step[nearest]
    return found
