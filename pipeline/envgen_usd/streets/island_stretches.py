"""Where streets have islands between their directions, and the cross-sections around these."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_plan import (
    CARRIAGEWAY,
    MappedStreet,
    StreetLane,
    StreetPlan,
    StreetProfile,
)
from envgen_usd.streets.junction_clusters import JunctionPlan, plan_junctions
from envgen_usd.streets.street_sections import LONGEST_TAPER, MEDIAN, TAPER_SHARE, line_offset

ISLAND_WIDTH = 2.0
"""Width of an island, metres; RASt 06 (6.1.8.2) asks for 2.0 m and more where bicycles wait."""
ISLAND_LENGTH = 8.0
"""Length of an island where there is room, metres."""
_LEAST_LENGTH = 6.0
"""Least length of an island, metres: a crossing of 3 m, two ramps of 0.5 m, two heads of 1 m."""
_CLEAR = 0.25
"""Distance of an island from the lanes beside it, metres."""
_LEAST_LANE = 2.75
"""Least width of a driving lane beside an island, metres."""
_LEAST_SIDEWALK = 1.5
"""Least width down to which sidewalks give way to an island, metres."""
_FROM_END = 0.5
"""Least distance of an island from the end of its street, metres."""
_LEAST_REST = 8.0
"""Length of a street from which the lanes close again before its end, metres."""
_ON_STREET = 1.0
"""Farthest node from the line of its street, metres."""
_FARTHEST = 15.0
"""Longest way by which an island moves out of its junction together with its crossing, metres."""
_SHORT = 15.0
"""Length of a road below which its islands are left out first, metres."""
_NO_ROOM = "in a junction, or on a street too short for them"


@dataclass(frozen=True)
class Island:
    """An island of a street.

    Attributes:
        street: Number of the street.
        s: Distance of its middle along the street's line, metres.
    """

    street: int
    s: float


@dataclass(frozen=True)
class Islands:
    """The islands that the streets have room for.

    Attributes:
        built: The islands.
        left_out: Number of the others by reason.
    """

    built: tuple[Island, ...]
    left_out: Mapping[str, int]

    def without(self, islands: Sequence[Island]) -> "Islands":
        """The islands but for some for which there is no room after all."""
        counts = Counter(self.left_out)
        counts[_NO_ROOM] += len(islands)
        return Islands(tuple(x for x in self.built if x not in islands), counts)

    def issues(self, source: str) -> Iterator[Issue]:
        """Issues that count the islands that are not built, for the map with a name."""
        for why, number in self.left_out.items():
            text = f"{number} islands of streets lie {why}"
            yield Issue("streets.island", Severity.INFO, source, text, "left out")


def plan_islands(
    plan: StreetPlan, curves: Sequence[RoundedLine], junctions: JunctionPlan
) -> tuple[StreetPlan, JunctionPlan, Islands]:
    """The streets with the islands of the map, and where they end now that some are wider.

    An island for which two junctions would become one is left out.

    Args:
        plan: The streets; nodes of islands are points of the kind ``island``.
        curves: Their lines.
        junctions: Where the streets end without islands.
    """
    islands = _found(plan, curves, junctions)
    while islands.built:
        wider = with_islands(plan, curves, junctions, islands.built)
        after = plan_junctions(wider, curves)
        lost = [x for x in islands.built if place_of(x, after) is None]
        if not lost and len(after.clusters) == len(junctions.clusters):
            return wider, after, islands
        # On a short road, an island is the likely reason; longer ones may stay.
        rooms = {x: _room(junctions, x) for x in lost or islands.built}
        short = [x for x, room in rooms.items() if room < _SHORT]
        islands = islands.without(short or lost or [min(rooms, key=lambda x: rooms[x])])
    return plan, junctions, islands


def _room(junctions: JunctionPlan, island: Island) -> float:
    """Length of the road of an island, metres."""
    cut = junctions.cuts[island.street]
    return 0.0 if cut is None else cut[1] - cut[0]


def _found(plan: StreetPlan, curves: Sequence[RoundedLine], junctions: JunctionPlan) -> Islands:
    """The islands of the map, each on its street and at least 0.5 m before the street's ends."""
    points = [point for point in plan.points if point.kind == "island"]
    if not points:
        return Islands((), {})
    lines = [
        shapely.LineString(c(np.linspace(0.0, c.length, max(int(c.length / 2), 2)))[0])
        for c in curves
    ]
    tree = shapely.STRtree(lines)
    built: list[Island] = []
    left_out: Counter[str] = Counter()
    for point in points:
        place = shapely.Point(point.place)
        found: list[Island | str] = []
        for n in tree.query(place, predicate="dwithin", distance=_ON_STREET).tolist():
            s = shapely.line_locate_point(lines[n], place) * curves[n].length / lines[n].length
            found.append(_fitted(Island(n, float(s)), plan, curves, junctions))
        fits = [each for each in found if isinstance(each, Island)]
        if fits:
            built += fits[:1]
        else:
            left_out[
                next((why for why in found if isinstance(why, str)), "off the lines of streets")
            ] += 1
    return Islands(tuple(_apart(built, left_out)), left_out)


def _fitted(
    island: Island, plan: StreetPlan, curves: Sequence[RoundedLine], junctions: JunctionPlan
) -> Island | str:
    """The island where there is room for it, or the reason why there is none."""
    street, place = plan.streets[island.street], place_of(island, junctions)
    if place is None:
        return _NO_ROOM
    s, half = place[0], place[1] / 2.0
    moved = Island(island.street, s)
    profile = street.profiles[_stretch_at(_breaks(street, curves[island.street]), s)]
    if profile.shared or not (profile.driving("left") and profile.driving("right")):
        return "on a street without two directions side by side"
    first, last = _range(moved, street, curves[island.street], junctions)
    taper = min(LONGEST_TAPER, TAPER_SHARE * (last - first))
    cut = junctions.cuts[island.street]
    assert cut is not None
    before, after = (0.0 if first <= cut[0] else taper), (0.0 if last >= cut[1] else taper)
    if s - half < first + before or s + half > last - after:
        return "where lanes begin or end"
    return moved


def place_of(island: Island, junctions: JunctionPlan) -> tuple[float, float] | None:
    """Distance of an island's middle along its street, out of junctions, and its length, metres.

    `None` where there is no room.
    """
    cut = junctions.cuts[island.street]
    length = 0.0 if cut is None else min(cut[1] - cut[0] - 2.0 * _FROM_END, ISLAND_LENGTH)
    if cut is None or length < _LEAST_LENGTH:
        return None
    room = length / 2.0 + _FROM_END
    s = float(np.clip(island.s, cut[0] + room, cut[1] - room))
    return (s, length) if abs(s - island.s) <= _FARTHEST else None


def _apart(islands: Sequence[Island], left_out: Counter[str]) -> Iterator[Island]:
    """The islands that overlap none before them on their street."""
    last: dict[int, list[float]] = defaultdict(list)
    for island in islands:
        if any(abs(island.s - s) < ISLAND_LENGTH + 1.0 for s in last[island.street]):
            left_out["at another island"] += 1
        else:
            last[island.street].append(island.s)
            yield island


def with_islands(
    plan: StreetPlan,
    curves: Sequence[RoundedLine],
    junctions: JunctionPlan,
    islands: Sequence[Island],
) -> StreetPlan:
    """The plan with a stretch around each island, in which a lane opens between the directions.

    1. The lane is 2.5 m wide beside the island. It opens and closes over up to 20 m. Where less
       than that is left before a junction, it reaches up to the junction.
    2. Driving lanes become narrower, down to 2.75 m; nobody parks there; sidewalks give way down to
       1.5 m. What is missing widens the road on both sides alike.

    Args:
        plan: The streets.
        curves: Their lines.
        junctions: Where the streets end.
        islands: The islands.
    """
    of: dict[int, list[tuple[float, float]]] = defaultdict(list)
    for island in islands:
        n = island.street
        of[n].append(_range(island, plan.streets[n], curves[n], junctions))
    streets = list(plan.streets)
    for n, ranges in of.items():
        for first, last in _joined(ranges):
            streets[n] = _with_stretch(streets[n], curves[n], first, last)
    return replace(plan, streets=tuple(streets))


def _joined(ranges: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Ranges without overlap; the lane does not close between islands that are near."""
    found: list[tuple[float, float]] = []
    for first, last in sorted(ranges):
        if found and first < found[-1][1] + _LEAST_REST:
            found[-1] = (found[-1][0], max(last, found[-1][1]))
        else:
            found.append((first, last))
    return found


def _range(
    island: Island, street: MappedStreet, curve: RoundedLine, junctions: JunctionPlan
) -> tuple[float, float]:
    """Distances along a street between which its lanes lead around an island.

    They lie within the stretches of the same lanes, as parked vehicles do not count.
    """
    cut = junctions.cuts[island.street]
    assert cut is not None
    breaks = _breaks(street, curve)
    own = _stretch_at(breaks, island.s)
    low = high = own
    while low > 0 and _alike(street.profiles[low - 1], street.profiles[own]):
        low -= 1
    while high + 2 < len(breaks) and _alike(street.profiles[high + 1], street.profiles[own]):
        high += 1
    reach = ISLAND_LENGTH / 2.0 + LONGEST_TAPER + 0.5
    first, last = max(island.s - reach, breaks[low]), min(island.s + reach, breaks[high + 1])
    if first - _LEAST_REST < cut[0]:
        first = 0.0 if low == 0 else first
    if last + _LEAST_REST > cut[1]:
        last = curve.length if high == len(breaks) - 2 else last
    return float(first), float(last)


def _alike(first: StreetProfile, second: StreetProfile) -> bool:
    """True if two cross-sections have the same lanes but for those where vehicles park."""

    def kinds(profile: StreetProfile) -> list[list[tuple[str, bool]]]:
        sides = (profile.left, profile.right)
        return [[(x.kind, x.raised) for x in side if x.kind != "parking"] for side in sides]

    same = (first.shared, first.level) == (second.shared, second.level)
    return same and kinds(first) == kinds(second)


def _breaks(street: MappedStreet, curve: RoundedLine) -> FloatArray:
    """Distances along a street at which its stretches begin, and its length."""
    return np.append(_along(street, curve)[list(street.breaks)], curve.length)


def _along(street: MappedStreet, curve: RoundedLine) -> FloatArray:
    steps = np.linalg.norm(np.diff(street.line, axis=0), axis=1)
    along: FloatArray = np.append(0.0, np.cumsum(steps)) * curve.length / steps.sum()
    return along


def _stretch_at(breaks: FloatArray, s: float) -> int:
    return int(np.clip(np.searchsorted(breaks, s, "right") - 1, 0, len(breaks) - 2))


def _with_stretch(
    street: MappedStreet, curve: RoundedLine, first: float, last: float
) -> MappedStreet:
    """A street with the stretch of an island; its line gets vertices where that begins and ends."""
    along, breaks = _along(street, curve), _breaks(street, curve)
    new = [s for s in (first, last) if np.abs(along - s).min() > 1e-6]
    all_along = np.sort(np.append(along, new))
    line = np.column_stack([np.interp(all_along, along, axis) for axis in street.line.T])
    own = street.profiles[_stretch_at(breaks, (first + last) / 2.0)]
    starts: list[float] = []
    profiles: list[StreetProfile] = []
    ways: list[int] = []
    for (low, high), profile, way in zip(
        pairwise(breaks.tolist()), street.profiles, street.ways, strict=True
    ):
        for begin, end in ((low, min(high, first)), (max(low, last), high)):
            if end - begin > 1e-6:
                starts.append(begin)
                profiles.append(profile)
                ways.append(way)
    way = street.ways[_stretch_at(breaks, (first + last) / 2.0)]
    place = int(np.searchsorted(starts, first + 1e-6))
    starts.insert(place, first)
    profiles.insert(place, _around(own))
    ways.insert(place, way)
    at = tuple(int(np.abs(all_along - s).argmin()) for s in starts)
    return replace(street, line=line, breaks=at, profiles=tuple(profiles), ways=tuple(ways))


def _around(profile: StreetProfile) -> StreetProfile:
    """The cross-section beside an island, see rule 2 of `with_islands`."""
    median = StreetLane(MEDIAN, ISLAND_WIDTH + 2.0 * _CLEAR)
    before = [_on_road(side) for side in (profile.left, profile.right)]
    driven = sum(x.width for side in before for x in side if x.kind == "driving")
    free = sum(x.width for side in before for x in side if x.kind != "biking")
    share = max(free - median.width, 0.0) / driven
    left, right = ([_beside(x, share) for x in side] for side in (profile.left, profile.right))
    after = [_on_road(side) for side in ([median, *left], right)]
    widths = [[sum(x.width for x in side) for side in sides] for sides in (before, after)]
    # Both kerbs move outwards alike.
    out = (sum(widths[1]) - sum(widths[0])) / 2.0
    line = profile.line
    if line is None or line == StreetProfile.TRANSITION:
        usual = line_offset(replace(profile, line=None))
        line = _line_at(usual + widths[1][1] - widths[0][1] - out, after)
    elif line[0] == "left":
        line = ("left", line[1] + 1.0)
    sides = [[_given_way(x, out) for x in side] for side in ([median, *left], right)]
    return replace(profile, left=tuple(sides[0]), right=tuple(sides[1]), line=line)


def _on_road(side: Sequence[StreetLane]) -> list[StreetLane]:
    """The lanes of a side between its kerb and the middle."""
    return [x for x in side if (x.kind in CARRIAGEWAY or x.kind == "parking") and not x.raised]


def _beside(lane: StreetLane, share: float) -> StreetLane:
    """A lane beside an island; driving lanes share what is left, but get no wider than before."""
    if lane.kind == "parking":
        return replace(lane, width=0.0)
    if lane.kind != "driving":
        return lane
    width = min(max(lane.width * share, _LEAST_LANE), max(lane.width, _LEAST_LANE))
    return replace(lane, width=round(width, 3))


def _given_way(lane: StreetLane, out: float) -> StreetLane:
    """A lane whose kerb moves outwards; sidewalks give way."""
    if lane.kind != "sidewalk":
        return lane
    return replace(lane, width=max(lane.width - max(out, 0.0), min(lane.width, _LEAST_SIDEWALK)))


def _line_at(offset: float, sides: Sequence[Sequence[StreetLane]]) -> tuple[str, float]:
    """`StreetProfile.line` for a middle at a distance left of the map's line, metres."""
    name, lanes = ("right", sides[1]) if offset > 0.0 else ("left", sides[0])
    rest = abs(offset)
    for n, lane in enumerate(lanes):
        if rest < lane.width:
            return name, n + rest / lane.width
        rest -= lane.width
    return name, float(len(lanes))
