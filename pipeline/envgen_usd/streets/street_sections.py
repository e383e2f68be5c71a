"""Lane sections of a mapped street: widths of lanes along it, and how lanes go on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.street_plan import CARRIAGEWAY, MappedStreet, StreetLane, StreetProfile

MEDIAN = "restricted"
"""Type of the lane between the directions beside an island, which traffic does not use."""
Steps = tuple[tuple[float, float], ...]
"""Distances and values between which a figure goes over smoothly, metres."""
_LEAST_SECTION = 8.0
"""Least length of a lane section, metres; shorter ones join their longer neighbour."""
LONGEST_TAPER = 20.0
"""Longest way over which a lane widens, metres."""
TAPER_SHARE = 0.4
"""Largest share of a section over which its lanes widen at either end."""
_PARKING_FREE = 9.0
"""Length beside a junction without parking, metres; StVO section 12 asks for 5 m and more."""
_PARKING_TAPER = 3.0
"""Length over which a parking lane widens, metres."""
_LEAST_PARKING = 6.0
"""Least length of a parking lane, metres."""


@dataclass(frozen=True)
class SectionLane:
    """A lane of a section.

    Attributes:
        lane: What the map says about it.
        number: Lane id.
        width: Its width along the section.
        before: Lane id in the section before, or `None`.
        after: Lane id in the section after, or `None`.
    """

    lane: StreetLane
    number: int
    width: Steps
    before: int | None = None
    after: int | None = None


@dataclass(frozen=True)
class StreetSection:
    """A lane section.

    Attributes:
        start: Distance along the road, metres.
        length: Metres.
        profile: Cross-section of the map.
        left: Lanes left of the middle, outwards.
        right: Lanes right of the middle, outwards.
        offset: Distance of the middle from the reference line, to the left.
    """

    start: float
    length: float
    profile: StreetProfile
    left: tuple[SectionLane, ...]
    right: tuple[SectionLane, ...]
    offset: Steps


def value_of(steps: Steps, s: float) -> float:
    """A figure at a distance, metres."""
    return float(np.interp(s, [at for at, _ in steps], [value for _, value in steps]))


def street_sections(
    street: MappedStreet, curve: RoundedLine, cut: tuple[float, float], ends: tuple[bool, bool]
) -> tuple[StreetSection, ...]:
    """Sections of a street between its junctions.

    1. A section for each stretch of the map; short ones join a neighbour.
    2. Lanes of neighbouring sections belong together by their kind, driving lanes from the middle
       or, where a left turn begins, from the kerb.
    3. At the border of two sections lanes have the mean of both widths, 0 where they begin or end.
    4. The middle of the carriageway stays on the map's line, or the lane that the map names.

    Args:
        street: The street.
        curve: Its line.
        cut: Distances between which it is a road, metres.
        ends: Whether there is a junction at its start and at its end.
    """
    stretches = [
        (_with_room_to_park(profile, high - low), low, high)
        for profile, low, high in _stretches(street, curve, cut)
    ]
    profiles = [profile for profile, _, _ in stretches]
    joints = [_joint(a, b) for a, b in pairwise(profiles)]
    return tuple(
        _section(
            stretches[n],
            joints[n - 1] if n else None,
            joints[n] if n < len(joints) else None,
            (ends[0] and n == 0, ends[1] and n == len(joints)),
            cut[0],
        )
        for n in range(len(stretches))
    )


_Stretch = tuple[StreetProfile, float, float]


def _stretches(
    street: MappedStreet, curve: RoundedLine, cut: tuple[float, float]
) -> list[_Stretch]:
    """Cross-sections with the distances between which they hold."""
    steps = np.linalg.norm(np.diff(street.line, axis=0), axis=1)
    along = np.append(0.0, np.cumsum(steps)) * curve.length / steps.sum()
    firsts = [along[n] for n in street.breaks]
    lasts = [*firsts[1:], curve.length]
    found: list[_Stretch] = []
    for profile, first, last in zip(street.profiles, firsts, lasts, strict=True):
        low, high = max(first, cut[0]), min(last, cut[1])
        if high - low > 1e-6:
            found.append((profile, float(low), float(high)))
    while len(found) > 1:
        lengths = [high - low for _, low, high in found]
        n = int(np.argmin(lengths))
        if lengths[n] >= _LEAST_SECTION:
            break
        _, low, high = found.pop(n)
        if n == len(found) or (n and lengths[n - 1] > lengths[n + 1]):
            found[n - 1] = (found[n - 1][0], found[n - 1][1], high)
        else:
            found[n] = (found[n][0], low, found[n][2])
    return found


@dataclass(frozen=True)
class _Joint:
    """Pairs of lanes that go on at a border of two sections, by side."""

    pairs: dict[str, tuple[tuple[int, int], ...]]
    profiles: tuple[StreetProfile, StreetProfile]

    def width(self, side: str, place: int, first: bool) -> float:
        """Width of a lane at the border; 0 for one that begins or ends there.

        Lanes lead around an island within its own section.
        """
        parted = [any(lane.kind == MEDIAN for lane in p.left) for p in self.profiles]
        for pair in self.pairs[side]:
            if pair[0 if first else 1] == place:
                lanes = [getattr(p, side)[n] for p, n in zip(self.profiles, pair, strict=True)]
                if parted[0] != parted[1]:
                    return float(lanes[parted[0]].width)
                return float(lanes[0].width + lanes[1].width) / 2.0
        return 0.0

    def other(self, side: str, place: int, first: bool) -> int | None:
        """Place of the lane that goes on, on the other side of the border."""
        for pair in self.pairs[side]:
            if pair[0 if first else 1] == place:
                return pair[1 if first else 0]
        return None


def _joint(first: StreetProfile, second: StreetProfile) -> _Joint:
    pairs = {
        side: _pairs(getattr(first, side), getattr(second, side)) for side in ("left", "right")
    }
    return _Joint(pairs, (first, second))


def _pairs(
    first: Sequence[StreetLane], second: Sequence[StreetLane]
) -> tuple[tuple[int, int], ...]:
    """Places of lanes of the same kind, see rule 2; the order outwards stays."""
    found: list[tuple[int, int]] = []
    driving = [[n for n, lane in enumerate(s) if lane.kind == "driving"] for s in (first, second)]
    more = first if len(driving[0]) > len(driving[1]) else second
    extra = abs(len(driving[0]) - len(driving[1]))
    inner = bool(extra) and all(
        lane.turns == {"left"} for lane in [x for x in more if x.kind == "driving"][:extra]
    )
    count = min(map(len, driving))
    shown = [places[len(places) - count :] if inner else places[:count] for places in driving]
    found += zip(*shown, strict=True)
    for n, lane in enumerate(first):
        if lane.kind != "driving":
            last = found[-1][1] if found else -1
            same = [
                m
                for m, other in enumerate(second)
                if m > last and (other.kind, other.raised) == (lane.kind, lane.raised)
            ]
            if same:
                found.append((n, same[0]))
    return tuple(found)


def _section(
    stretch: _Stretch,
    before: _Joint | None,
    after: _Joint | None,
    at_junction: tuple[bool, bool],
    origin: float,
) -> StreetSection:
    profile, low, high = stretch
    length = high - low
    taper = min(LONGEST_TAPER, TAPER_SHARE * length)
    widths: dict[str, list[Steps]] = {}
    for side in ("left", "right"):
        widths[side] = []
        for n, lane in enumerate(getattr(profile, side)):
            first = before.width(side, n, first=False) if before else lane.width
            last = after.width(side, n, first=True) if after else lane.width
            if lane.kind == "parking" and (lane.width or not first + last):
                steps = _parking_steps(lane.width, length, at_junction, (first, last))
            else:
                steps = _ramps((first, lane.width, last), length, taper)
            widths[side].append(steps)
    for side, own in widths.items():
        _widen_sidewalk(getattr(profile, side), own, length, at_junction)
    lanes = {
        side: tuple(
            SectionLane(
                lane,
                (n + 1) * (1 if side == "left" else -1),
                widths[side][n],
                _number(before.other(side, n, first=False) if before else None, side),
                _number(after.other(side, n, first=True) if after else None, side),
            )
            for n, lane in enumerate(getattr(profile, side))
        )
        for side in ("left", "right")
    }
    offset = _offset(profile, before, after, length, taper)
    return StreetSection(low - origin, length, profile, lanes["left"], lanes["right"], offset)


def _number(place: int | None, side: str) -> int | None:
    return None if place is None else (place + 1) * (1 if side == "left" else -1)


def _with_room_to_park(profile: StreetProfile, length: float) -> StreetProfile:
    """The cross-section with parking lanes of no width where a section is too short for them."""
    if length > 2.0 * (_PARKING_FREE + _PARKING_TAPER) + _LEAST_PARKING:
        return profile

    def free(lanes: tuple[StreetLane, ...]) -> tuple[StreetLane, ...]:
        return tuple(replace(x, width=0.0) if x.kind == "parking" else x for x in lanes)

    return replace(profile, left=free(profile.left), right=free(profile.right))


def _ramps(values: tuple[float, float, float], length: float, taper: float) -> Steps:
    first, width, last = values
    return ((0.0, first), (taper, width), (length - taper, width), (length, last))


def _parking_steps(
    width: float, length: float, at_junction: tuple[bool, bool], joints: tuple[float, float]
) -> Steps:
    """No width beside junctions, the full one between."""
    if not width:
        return ((0.0, 0.0), (length, 0.0))
    free, ramp = _PARKING_FREE, _PARKING_TAPER
    begin = [(0.0, 0.0), (free, 0.0), (free + ramp, width)]
    end = [(length - free - ramp, width), (length - free, 0.0), (length, 0.0)]
    if not at_junction[0]:
        begin = [(0.0, joints[0] if joints[0] == width else 0.0), (ramp, width)]
    if not at_junction[1]:
        end = [(length - ramp, width), (length, joints[1] if joints[1] == width else 0.0)]
    return (*begin, *end)


def _widen_sidewalk(
    lanes: Sequence[StreetLane],
    widths: list[Steps],
    length: float,
    at_junction: tuple[bool, bool],
) -> None:
    """Lets the sidewalk take the place of the parking lane beside junctions; changes `widths`."""
    full = sum(lane.width for lane in lanes if lane.kind == "parking")
    walks = [n for n, lane in enumerate(lanes) if lane.kind == "sidewalk"]
    if not full or not walks:
        return
    walk = widths[walks[0]]
    free, ramp = _PARKING_FREE, _PARKING_TAPER
    extra = [(0.0, full), (free, full), (free + ramp, 0.0)] if at_junction[0] else [(0.0, 0.0)]
    end = [(length - free - ramp, 0.0), (length - free, full), (length, full)]
    extra += end if at_junction[1] else [(length, 0.0)]
    at = sorted({s for s, _ in (*walk, *extra)})
    widths[walks[0]] = tuple((s, value_of(walk, s) + value_of(tuple(extra), s)) for s in at)


def _offset(
    profile: StreetProfile,
    before: _Joint | None,
    after: _Joint | None,
    length: float,
    taper: float,
) -> Steps:
    """Distance of the middle, so that the map's line lies where it says.

    That is the middle of the carriageway as a rule, see `StreetProfile.line`.
    """
    usual = line_offset(profile)
    first, last = (usual if joint is None else _at_joint(joint) for joint in (before, after))
    if profile.line == StreetProfile.TRANSITION:
        return ((0.0, first), (length, last))
    return _ramps((first, usual, last), length, taper)


def _at_joint(joint: _Joint) -> float:
    """Distance of the middle at a border of two sections: the mean of what both ask."""
    found = [
        _middle(profile, partial(joint.width, first=is_first))
        for profile, is_first in zip(joint.profiles, (True, False), strict=True)
        if profile.line != StreetProfile.TRANSITION
    ]
    plain = [
        _middle(replace(profile, line=None), partial(joint.width, first=is_first))
        for profile, is_first in zip(joint.profiles, (True, False), strict=True)
    ]
    return float(np.mean(found or plain))


def line_offset(profile: StreetProfile) -> float:
    """Distance of the middle of a cross-section from the map's line, to its left, metres."""
    return _middle(profile, lambda side, n: float(getattr(profile, side)[n].width))


def _middle(profile: StreetProfile, width: Callable[[str, int], float]) -> float:
    """Distance of the middle from the map's line, to its left, by the widths of lanes."""
    if profile.line in {None, StreetProfile.TRANSITION}:
        halves = [
            sum(
                width(side, n)
                for n, lane in enumerate(getattr(profile, side))
                if lane.kind in CARRIAGEWAY and not lane.raised
            )
            for side in ("right", "left")
        ]
        return (halves[0] - halves[1]) / 2.0
    assert profile.line is not None
    side, lanes = profile.line
    whole = int(lanes)
    away = sum(width(side, n) for n in range(whole))
    if lanes > whole:
        away += (lanes - whole) * width(side, whole)
    return away if side == "right" else -away
