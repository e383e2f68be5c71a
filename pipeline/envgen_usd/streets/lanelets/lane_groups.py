"""Lanelets side by side as groups: the lanes of a road, and the borders between them."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanelet_map import FOOT, VEHICLE, Lanelet, LaneletMap, Side

LANE_TYPES: Mapping[str, str] = {
    "road": "driving",
    "highway": "driving",
    "play_street": "driving",
    "exit": "driving",
    "bus_lane": "bus",
    "emergency_lane": "stop",
    "bicycle_lane": "biking",
    "road_shoulder": "shoulder",
    **dict.fromkeys(FOOT, "sidewalk"),
}
"""Type of the lane of OpenDRIVE for each subtype of a lanelet."""


@dataclass(frozen=True)
class LaneGroup:
    """Lanelets side by side, from left to right.

    Attributes:
        lanelets: Index of each lanelet.
        along: Whether each runs along the group.
        borders: Bounds from left to right, a bound more than lanelets, along the group.
        divider: Number of the border that parts the directions: lanes before it lie left of it.
    """

    lanelets: tuple[int, ...]
    along: tuple[bool, ...]
    borders: tuple[Side, ...]
    divider: int = 0

    def lane_id(self, number: int) -> int:
        """Id of a lane in OpenDRIVE: positive left of the divider."""
        return self.divider - number if number < self.divider else self.divider - number - 1

    def turned(self) -> "LaneGroup":
        """The same group along the other direction."""
        return LaneGroup(
            self.lanelets[::-1],
            tuple(not each for each in self.along[::-1]),
            tuple(side.turned for side in self.borders[::-1]),
            len(self.lanelets) - self.divider,
        )


@dataclass(frozen=True)
class LaneGroups:
    """The groups of a map.

    Attributes:
        groups: The groups.
        left_hand: True where traffic drives on the left.
        unused: Subtype to number of lanelets that are no lanes.
    """

    groups: tuple[LaneGroup, ...]
    left_hand: bool
    unused: Mapping[str, int]


def lane_groups(source: LaneletMap) -> LaneGroups:
    """Groups the lanelets of a map that share bounds side by side."""
    lanes = [n for n, each in enumerate(source.lanelets) if each.subtype in LANE_TYPES]
    beside = _beside(source, lanes)
    done: set[int] = set()
    found = []
    for first in lanes:
        if first not in done:
            found.append(_grown(source, first, beside, done))
    found = [_towards_most(group, source) for group in found]
    left_hand = _drives_left(found, source)
    unused: dict[str, int] = defaultdict(int)
    for each in source.lanelets:
        if each.subtype not in LANE_TYPES and each.subtype != "crosswalk":
            unused[each.subtype] += 1
    return LaneGroups(
        tuple(_divided(group, source, left_hand) for group in found), left_hand, dict(unused)
    )


def border_points(source: LaneletMap, side: Side) -> FloatArray:
    """Points of a bound in its direction, N x 3."""
    points = source.lines[side.line].points
    return points if side.forward else points[::-1]


def border_ends(source: LaneletMap, side: Side) -> tuple[int, int]:
    """Numbers of the places where a bound begins and ends."""
    first, last = source.lines[side.line].ends
    return (first, last) if side.forward else (last, first)


def vehicle_span(group: LaneGroup, source: LaneletMap) -> tuple[int, int] | None:
    """Numbers of the outer borders of the lanes for vehicles; `None` without any."""
    kinds = [source.lanelets[n].subtype in VEHICLE for n in group.lanelets]
    if not any(kinds):
        return None
    return kinds.index(True), len(kinds) - kinds[::-1].index(True)


def group_area(group: LaneGroup, source: LaneletMap) -> shapely.Geometry | None:
    """Area of the lanes for vehicles; `None` without any."""
    span = vehicle_span(group, source)
    if span is None:
        return None
    left, right = (border_points(source, group.borders[n])[:, :2] for n in span)
    return shapely.buffer(shapely.polygons(np.concatenate([left, right[::-1]])), 0.0)


def _beside(source: LaneletMap, lanes: Sequence[int]) -> dict[tuple[int, bool], list[int]]:
    """Lanelets on a side of each line; the key is the line, and True for its right side."""
    found: dict[tuple[int, bool], list[int]] = defaultdict(list)
    for n in lanes:
        lanelet = source.lanelets[n]
        found[lanelet.left.line, lanelet.left.forward].append(n)
        found[lanelet.right.line, not lanelet.right.forward].append(n)
    return found


def _sides(lanelet: Lanelet, along: bool) -> tuple[Side, Side]:
    """Left and right bound along a group."""
    if along:
        return lanelet.left, lanelet.right
    return lanelet.right.turned, lanelet.left.turned


def _grown(
    source: LaneletMap,
    first: int,
    beside: Mapping[tuple[int, bool], list[int]],
    done: set[int],
) -> LaneGroup:
    """The group of a lanelet: neighbours are added on the right, then on the left."""
    done.add(first)
    chain = [(first, True)]
    for to_right in (True, False):
        while True:
            number, along = chain[-1 if to_right else 0]
            border = _sides(source.lanelets[number], along)[1 if to_right else 0]
            # The near side of the border must be free of overlapping lanelets, too.
            far = beside.get((border.line, border.forward == to_right), [])
            near = beside.get((border.line, border.forward != to_right), [])
            if len(far) != 1 or len(near) != 1 or far[0] in done:
                break
            other = source.lanelets[far[0]]
            same = _sides(other, True)[0 if to_right else 1] == border
            if not same and _sides(other, False)[0 if to_right else 1] != border:
                break
            done.add(far[0])
            if to_right:
                chain.append((far[0], same))
            else:
                chain.insert(0, (far[0], same))
    numbers, along_all = zip(*chain, strict=True)
    sides = [_sides(source.lanelets[n], along) for n, along in chain]
    return LaneGroup(numbers, along_all, (sides[0][0], *(right for _, right in sides)))


def _directed(group: LaneGroup, source: LaneletMap) -> list[int]:
    """1 for each lane along the group, -1 against it, 0 for both directions and for pedestrians."""
    found = []
    for number, along in zip(group.lanelets, group.along, strict=True):
        lanelet = source.lanelets[number]
        counts = lanelet.one_way and lanelet.subtype not in FOOT
        found.append((1 if along else -1) if counts else 0)
    return found


def _towards_most(group: LaneGroup, source: LaneletMap) -> LaneGroup:
    """The group along most of its lanes."""
    return group.turned() if sum(_directed(group, source)) < 0 else group


def _drives_left(groups: Sequence[LaneGroup], source: LaneletMap) -> bool:
    """Whether opposite lanes lie on the right of each other on most roads."""
    votes = 0
    for group in groups:
        flow = [each for each in _directed(group, source) if each]
        votes += sum((b - a) // 2 for a, b in pairwise(flow))
    return votes < 0


def _divided(group: LaneGroup, source: LaneletMap, left_hand: bool) -> LaneGroup:
    """Finds the border that parts the directions best."""
    flow = np.array(_directed(group, source))
    right = flow * (-1 if left_hand else 1)
    scores = [int(right[k:].sum() - right[:k].sum()) for k in range(len(flow) + 1)]
    span = vehicle_span(group, source) or (0, len(flow))
    order = range(span[0], span[1] + 1)
    best = max(order, key=lambda k: (scores[k], k if left_hand else -k))
    return LaneGroup(group.lanelets, group.along, group.borders, best)
