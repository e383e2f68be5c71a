"""Seams: the straight cuts where roads of lanelets meet, shared by all roads that meet there.

Lanelets end at any angle, roads of OpenDRIVE end square to their reference lines. So all roads of a
seam end at a single straight cut, and their borders go on up to it along those of the next road.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanelet_map import LaneletMap
from envgen_usd.streets.lanelets.lane_groups import border_points, vehicle_span
from envgen_usd.streets.lanelets.road_strips import LaneEnd, RoadPlan, RoadStrip

_BACK = 4.0
"""Length of border from whose two halves a seam's heading follows, metres."""
_LEVEL = 0.003
"""Cross slope below which a seam is level."""
_STEEPEST = 0.15
"""Largest cross slope and largest grade of a seam."""


@dataclass(frozen=True, eq=False)
class Seam:
    """A cut where roads meet or a road ends.

    Attributes:
        place: x and y of a point on it, metres.
        heading: Direction of the roads there, radians.
        height: Height at `place`, metres.
        slope: Rise to the left of `heading`.
        grade: Rise along `heading`.
        side: 1, or -1 where it is seen from the other side than by other roads of the seam.
    """

    place: FloatArray
    heading: float
    height: float
    slope: float
    grade: float
    side: float = 1.0

    @property
    def ahead(self) -> FloatArray:
        """Unit vector along the heading."""
        return np.array([np.cos(self.heading), np.sin(self.heading)])

    @property
    def left(self) -> FloatArray:
        """Unit vector to the left of the heading."""
        return np.array([-np.sin(self.heading), np.cos(self.heading)])

    def turned(self) -> "Seam":
        """The same cut, seen against its heading."""
        heading, slope, grade = self.heading + np.pi, -self.slope, -self.grade
        return Seam(self.place, heading, self.height, slope, grade, -self.side)


def strip_borders(strip: RoadStrip, source: LaneletMap) -> list[FloatArray]:
    """Points of the borders of a road from left to right, each N x 3."""
    found = []
    for number in range(len(strip.groups[0].borders)):
        parts = [border_points(source, group.borders[number]) for group in strip.groups]
        found.append(np.concatenate([parts[0], *(part[1:] for part in parts[1:])]))
    return found


def road_seams(
    plan: RoadPlan, borders: Sequence[Sequence[FloatArray]], source: LaneletMap
) -> dict[tuple[int, int], Seam]:
    """The seam at each end of each road, whose heading is that of the road.

    Args:
        plan: Roads.
        borders: Borders of each road.
        source: The map.

    Returns:
        Number of the road and 0 for its begin, 1 for its end, to the seam.
    """
    sides = _sides(plan)
    members: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for key, (root, _) in sides.items():
        members[root].append(key)
    found = {}
    for keys in members.values():
        outside = [key for key in keys if plan.strips[key[0]].junction < 0] or keys
        seam = _seam(outside, keys, sides, plan, borders, source)
        for key in keys:
            # Roads leave at their ends and enter at their begins.
            along = (sides[key][1] > 0) == (key[1] == 1)
            found[key] = seam if along else seam.turned()
    return found


def _sides(plan: RoadPlan) -> dict[tuple[int, int], tuple[int, int]]:
    """Number of the seam of each road end, and 1 or -1 for its side of the seam."""
    near: dict[tuple[int, int], set[tuple[int, int]]] = defaultdict(set)
    for here, others in plan.onward.items():
        for there in others:
            near[here.strip, here.end].add((there.strip, there.end))
            near[there.strip, there.end].add((here.strip, here.end))
    found: dict[tuple[int, int], tuple[int, int]] = {}
    for n in range(len(plan.strips)):
        for end in (1, 0):
            if (n, end) in found:
                continue
            root, stack = len(found), [((n, end), 1)]
            while stack:
                key, side = stack.pop()
                if key in found:
                    continue
                found[key] = root, side
                stack += [(other, -side) for other in near[key]]
    return found


def _seam(  # noqa: PLR0913, PLR0917 - what a seam follows from
    deciding: Sequence[tuple[int, int]],
    keys: Sequence[tuple[int, int]],
    sides: Mapping[tuple[int, int], tuple[int, int]],
    plan: RoadPlan,
    borders: Sequence[Sequence[FloatArray]],
    source: LaneletMap,
) -> Seam:
    chords = np.concatenate([sides[key][1] * _outward(borders[key[0]], key[1]) for key in deciding])
    ahead = chords.sum(0)
    if np.hypot(*ahead) < 1e-6:
        ahead = chords[0]
    heading = float(np.arctan2(ahead[1], ahead[0]))
    ends = np.concatenate(
        [np.array([line[-key[1]] for line in borders[key[0]]]) for key in deciding]
    )
    place = ends[:, :2].mean(0)
    left = np.array([-np.sin(heading), np.cos(heading)])
    paved = [(key, _paved(key[0], plan, borders, source)) for key in keys]
    ends = np.array([line[-key[1]] for key, lines in paved for line in lines])
    height, slope = _plane((ends[:, :2] - place) @ left, ends[:, 2])
    rises = [sides[key][1] * _rise(line, key[1]) for key, lines in paved for line in lines]
    grade = float(np.clip(np.mean(rises), -_STEEPEST, _STEEPEST))
    return Seam(place, heading, height, slope, grade)


def _paved(
    number: int,
    plan: RoadPlan,
    borders: Sequence[Sequence[FloatArray]],
    source: LaneletMap,
) -> Sequence[FloatArray]:
    """Borders of a road's lanes for vehicles; all borders where there is none."""
    lines = borders[number]
    span = vehicle_span(plan.strips[number].groups[0], source) or (0, len(lines) - 1)
    return lines[span[0] : span[1] + 1]


def _rise(line: FloatArray, end: int) -> float:
    """Slope of the last metres of a border out of its road."""
    away = line[::-1] if end else line
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(away[:, :2], axis=0), axis=1))])
    back = min(_BACK, float(along[-1]))
    return float(away[0, 2] - np.interp(back, along, away[:, 2])) / max(back, 1e-9)


def _plane(t: FloatArray, z: FloatArray) -> tuple[float, float]:
    """Height at t = 0, and slope to the left, by least squares."""
    spread = t - t.mean()
    if float(spread @ spread) < 0.25:
        return float(z.mean()), 0.0
    slope = float(np.clip(spread @ (z - z.mean()) / (spread @ spread), -_STEEPEST, _STEEPEST))
    slope = slope if abs(slope) > _LEVEL else 0.0
    return float(z.mean() - slope * t.mean()), slope


def _outward(lines: Sequence[FloatArray], end: int) -> FloatArray:
    """Unit vectors out of a road along each border, K x 2."""
    found = []
    for line in lines:
        away = line[::-1, :2] if end else line[:, :2]
        steps = np.linalg.norm(np.diff(away, axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        back = min(_BACK, float(along[-1]))
        inner, middle = (
            np.array([np.interp(at, along, away[:, axis]) for axis in (0, 1)])
            for at in (back, back / 2.0)
        )
        # A border that bends on evenly to its end has this direction there.
        step = 3.0 * (away[0] - middle) - (middle - inner)
        found.append(step / max(float(np.hypot(*step)), 1e-9))
    return np.array(found)


def lane_ends(plan: RoadPlan, strip: int, end: int) -> list[tuple[LaneEnd, ...]]:
    """What each lane of a road leads to at an end."""
    count = len(plan.strips[strip].groups[-end].lanelets)
    return [plan.onward.get(LaneEnd(strip, end, lane), ()) for lane in range(count)]
