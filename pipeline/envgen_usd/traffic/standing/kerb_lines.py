"""Lines along which vehicles may park: kerbs and parking lanes, and where they stay free.

Distances are those of the German road traffic regulations (StVO, section 12), which most of
Europe shares: 5 m before crossings and junctions, 10 m before traffic lights, 15 m at stops, none
before driveways, 3 m of a lane beside a solid line.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.lanes import DRIVEN
from envgen_usd.models.road_surface import LaneLine
from envgen_usd.traffic.standing.street_facts import StreetFacts

LEAST_ROOM = 3.05
"""Metres of carriageway that stay free beside parked vehicles: 2.55 of a lorry and 0.5 (§ 12)."""
_BESIDE_SOLID = 3.0
"""Metres between a parked vehicle and a solid centre line (sign 295)."""
_FASTEST = 60.0 / 3.6
"""Highest speed limit of a street with vehicles at its kerb, m/s."""
_FASTEST_BESIDE = 70.0 / 3.6
"""Highest speed limit where vehicles stand beside the driven lanes, not on them, m/s."""
_STRIP = 2.0
"""Width of a paved strip beside the driven lanes that holds parked vehicles, metres (RASt 06).

On streets with several lanes each way, vehicles stand nowhere else.
"""
_SHARPEST = 1.0 / 40.0
"""Largest curvature of a kerb with vehicles, 1/m; a larger value parks in narrower bends."""
_PARKED = frozenset({"driving", "bidirectional", "shared"})
"""Types of the outermost lane where vehicles may park at its edge."""
_FLUSH = frozenset({"shoulder", "border", "stop"})
"""Types of paved lanes between the outermost driven lane and the kerb."""
_WALKS = frozenset({"sidewalk", "walking"})
_TOWN = frozenset({"town", "townLocal", "townCollector", "townPrivate", "lowSpeed"})
"""Types of roads where vehicles may park at an edge without a kerb."""
_FAST = frozenset({"motorway", "townExpressway", "townArterial", "rural", "bicycle", "pedestrian"})
"""Types of roads without parked vehicles; `townPlayStreet` has them on spaces alone."""

_FULL = 0.95
"""Share of the largest width of a parking lane up to which it narrows towards its ends."""

LineKind = Literal["kerb", "parking_lane"]


@dataclass(frozen=True, repr=False, eq=False)
class KerbLine(Model):
    """A kerb or the middle of a parking lane, in the direction of travel beside it.

    Attributes:
        lane: Lane at whose outer edge the line lies, or the parking lane.
        kind: What the line is.
        points: N x 3, metres.
        s: N, arc length along the line, metres.
        outward: 1 if the sidewalk lies to the left of the line, -1 if it lies to the right.
        width: Carriageway at its narrowest, or width of the parking lane, metres.
        beside: Distance from the kerb to the middle of the nearest driven lane, metres.
        walk: From the line to the far edge of the sidewalk behind it, metres; 0 without.
        sides: Sides of the carriageway with such lines: 1 or 2.
        left_side: True for the side of positive lane ids.
    """

    lane: LaneLine
    kind: LineKind
    points: FloatArray
    s: FloatArray
    outward: float
    width: float
    beside: float
    walk: float
    sides: int
    left_side: bool

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns the points (N x 3) and the directions (N, radians) at arc lengths."""
        points = np.stack([np.interp(s, self.s, axis) for axis in self.points.T], axis=1)
        step = [np.interp(s + d, self.s, axis) for axis in self.points.T[:2] for d in (-0.5, 0.5)]
        return points, np.arctan2(step[3] - step[2], step[1] - step[0])

    def is_straight(self, s: FloatArray, reach: float) -> BoolArray:
        """Returns where the line bends little within a distance of arc lengths, N."""
        before, after = self.at(s - reach)[1], self.at(s + reach)[1]
        turn = np.abs((after - before + np.pi) % (2 * np.pi) - np.pi)
        straight: BoolArray = turn <= 2 * reach * _SHARPEST
        return straight


def kerb_lines(lanes: Iterable[LaneLine], facts: StreetFacts) -> Iterator[KerbLine]:
    """Yields the lines along which the road file allows parking.

    Args:
        lanes: Lanes; a line belongs to the lane at whose edge it lies.
        facts: The map.
    """
    for lane in lanes:
        key = (lane.road, lane.section, lane.lane)
        if lane.junction or len(lane.points) < 2 or key in facts.banned:
            continue
        if lane.lane_type == "parking":
            wide = _full_width(lane)
            yield _line(wide, "parking_lane", _Room(float(wide.width.min()), 0.0, 0.0, 1), facts)
            continue
        edge = _edge(_side(lane, facts), facts)
        if edge is not None and edge[0] is lane:
            width, sides = _carriageway(lane, facts)
            yield _line(lane, "kerb", _Room(width, edge[1], edge[2], sides), facts)


@dataclass(frozen=True)
class _Room:
    """Widths beside a line; see `KerbLine`."""

    width: float
    beside: float
    walk: float
    sides: int


def _full_width(lane: LaneLine) -> LaneLine:
    """The longest part of a parking lane that does not narrow towards its ends."""
    is_wide = lane.width >= _FULL * lane.width.max()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_wide, [False]]).astype(np.int8)))
    steps = np.linalg.norm(np.diff(lane.points[:, :2], axis=0), axis=1)
    s = np.append(0.0, np.cumsum(steps))
    lengths = s[edges[1::2] - 1] - s[edges[::2]]
    longest = 2 * int(np.argmax(lengths))
    first, after = edges[longest : longest + 2].tolist()
    if after - first < 2:
        return lane
    return replace(lane, points=lane.points[first:after], width=lane.width[first:after])


def _side(lane: LaneLine, facts: StreetFacts) -> list[LaneLine]:
    """Lanes on the same side of the section, from the middle outwards."""
    section = facts.sections[lane.road, lane.section]
    same = [other for other in section if (other.lane > 0) == (lane.lane > 0) and other.lane]
    return sorted(same, key=lambda other: abs(other.lane))


def _edge(side: Sequence[LaneLine], facts: StreetFacts) -> tuple[LaneLine, float, float] | None:
    """The outermost paved lane at whose edge vehicles may park, or none.

    Returns:
        The lane; metres from its edge to the middle of the driven lane; width of the sidewalk.
    """
    driven = [n for n, lane in enumerate(side) if lane.lane_type in DRIVEN]
    if not driven:
        return None
    last = driven[-1]
    lane = side[last]
    while last + 1 < len(side) and side[last + 1].lane_type in _FLUSH:
        last += 1
    strip = _width(side[driven[-1] + 1 : last + 1])
    if lane.lane_type not in _PARKED or not _is_street(lane, strip, facts):
        return None
    if len(driven) > 1 and strip < _STRIP and _two_way(side[0], facts):
        return None
    if (lane.road, lane.section, lane.lane) in facts.banned:
        return None
    beside = strip + float(lane.width.min()) / 2
    beyond = side[last + 1 :]
    kerb = beyond[:1] if beyond and beyond[0].lane_type == "curb" else []
    walk = beyond[len(kerb) : len(kerb) + 1]
    if walk and walk[0].lane_type in _WALKS:
        return side[last], beside, _width([*kerb, *walk])
    open_edge = not beyond or beyond[0].lane_type == "none"
    town = facts.roads[lane.road].town in _TOWN
    return (side[last], beside, 0.0) if kerb or (open_edge and town) else None


def _is_street(lane: LaneLine, strip: float, facts: StreetFacts) -> bool:
    road = facts.roads.get(lane.road)
    if road is None or road.is_motorway or road.town in _FAST or road.town == "townPlayStreet":
        return False
    fastest = _FASTEST_BESIDE if strip >= _STRIP else _FASTEST
    return max(lane.speed, road.speed) <= fastest


def _two_way(lane: LaneLine, facts: StreetFacts) -> bool:
    section = facts.sections[lane.road, lane.section]
    return any(o.lane_type in DRIVEN and (o.lane > 0) != (lane.lane > 0) for o in section)


def _carriageway(lane: LaneLine, facts: StreetFacts) -> tuple[float, int]:
    """Width of the carriageway at its narrowest, metres, and its sides with a kerb.

    Beside a median, each direction is a carriageway of its own. Beside a solid line, too: traffic
    may not cross it, so that `_BESIDE_SOLID` replaces `LEAST_ROOM`.
    """
    section = facts.sections[lane.road, lane.section]
    near, far = (
        _paved(sorted((o for o in section if o.lane * sign > 0), key=lambda o: abs(o.lane)))
        for sign in (np.sign(lane.lane), -np.sign(lane.lane))
    )
    if not far:
        return _width(near), 1
    if (lane.road, lane.section) in facts.solid:
        return _width(near) + LEAST_ROOM - _BESIDE_SOLID, 1
    return _width(near) + _width(far), 2


def _paved(side: Sequence[LaneLine]) -> list[LaneLine]:
    """Lanes from the middle outwards, up to the first that is not driven or flush."""
    wide = []
    for lane in side:
        if lane.lane_type not in DRIVEN | _FLUSH:
            break
        wide.append(lane)
    return wide if any(lane.lane_type in DRIVEN for lane in wide) else []


def _width(lanes: Sequence[LaneLine]) -> float:
    return float(sum(lane.width.min() for lane in lanes))


def _line(lane: LaneLine, kind: LineKind, room: _Room, facts: StreetFacts) -> KerbLine:
    outward = _outward(lane, facts)
    tangent = np.gradient(lane.points[:, :2], axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    normal = outward * np.column_stack([-tangent[:, 1], tangent[:, 0]])
    points = lane.points.copy()
    if kind == "kerb":
        points[:, :2] += normal * lane.width[:, None] / 2
    steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    return KerbLine(
        lane,
        kind,
        points,
        s,
        outward,
        room.width,
        room.beside,
        room.walk,
        room.sides,
        lane.lane > 0,
    )


def _outward(lane: LaneLine, facts: StreetFacts) -> float:
    """1 if the outer side of a lane is on the left in its direction of travel, else -1."""
    road = facts.roads[lane.road]
    middle = len(lane.points) // 2
    at = lane.points[min(middle, len(lane.points) - 2)]
    step = lane.points[min(middle, len(lane.points) - 2) + 1] - at
    nearest = int(np.argmin(((road.points[:, :2] - at[:2]) ** 2).sum(axis=1)))
    along = np.array([np.cos(road.heading[nearest]), np.sin(road.heading[nearest])])
    return 1.0 if (step[:2] @ along > 0.0) == (lane.lane > 0) else -1.0


def ends_at_junctions(lane: LaneLine, facts: StreetFacts) -> tuple[bool, bool]:
    """Whether the first and the last point of a lane lie at a junction or at a dead end.

    The driven lanes of its side count, since shoulders and parking lanes often lack links.
    """
    driven = [other for other in _side(lane, facts) if other.lane_type in DRIVEN] or [lane]
    before = [name for other in driven for name in other.predecessors]
    after = [name for other in driven for name in other.successors]
    first, last = (
        not names or not facts.in_junctions.isdisjoint(names) for names in (before, after)
    )
    return first, last
