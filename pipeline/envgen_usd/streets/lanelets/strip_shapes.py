"""The shape of each road of lanelets: reference line and borders between its seams."""

from collections.abc import Mapping, Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanelet_map import LaneletMap
from envgen_usd.streets.lanelets.border_profiles import RoadShape, road_shape
from envgen_usd.streets.lanelets.lane_groups import border_ends, vehicle_span
from envgen_usd.streets.lanelets.reference_curves import reference_curve
from envgen_usd.streets.lanelets.road_seams import Seam, lane_ends, road_seams, strip_borders
from envgen_usd.streets.lanelets.road_strips import LaneEnd, RoadPlan

_ON = 12.0
"""Length by which borders go on beyond the ends of a road, metres."""


def strip_shapes(plan: RoadPlan, source: LaneletMap) -> list[RoadShape]:
    """Reference line and borders of each road."""
    borders = [strip_borders(strip, source) for strip in plan.strips]
    seams = road_seams(plan, borders, source)
    return [_shape(n, plan, borders, seams, source) for n in range(len(plan.strips))]


def section_ends(n: int, plan: RoadPlan, shape: RoadShape, source: LaneletMap) -> tuple[float, ...]:
    """S at which each group of a road ends."""
    strip, length = plan.strips[n], shape.curve.length
    ends: list[float] = []
    for group in strip.groups[:-1]:
        side = group.borders[group.divider]
        points = source.lines[side.line].points
        last = points[-1 if side.forward else 0]
        s = float(shape.curve.located(last[None, :2])[0][0])
        before = ends[-1] if ends else 0.0
        ends.append(float(np.clip(s, before + 0.01, max(length - 0.01, before + 0.01))))
    return (*ends, length)


def _shape(
    n: int,
    plan: RoadPlan,
    borders: Sequence[Sequence[FloatArray]],
    seams: Mapping[tuple[int, int], Seam],
    source: LaneletMap,
) -> RoadShape:
    strip, ends = plan.strips[n], (seams[n, 0], seams[n, 1])
    lines = [_extended(n, k, plan, borders, source) for k in range(len(borders[n]))]
    group = strip.groups[0]
    curve = reference_curve(lines[group.divider][:, :2], ends)
    paved = vehicle_span(group, source) or (0, len(lines) - 1)
    return road_shape(curve, lines, ends, paved)


def _extended(
    n: int,
    border: int,
    plan: RoadPlan,
    borders: Sequence[Sequence[FloatArray]],
    source: LaneletMap,
) -> FloatArray:
    """A border with what goes on beyond both ends of its road."""
    line = borders[n][border]
    before = _beyond(n, 0, border, plan, borders, source)
    after = _beyond(n, 1, border, plan, borders, source)
    return np.concatenate([before[::-1], line, after])


def _beyond(  # noqa: PLR0913, PLR0917 - what a border goes on as
    n: int,
    end: int,
    border: int,
    plan: RoadPlan,
    borders: Sequence[Sequence[FloatArray]],
    source: LaneletMap,
) -> FloatArray:
    """Points beyond an end of a border: of the straightest next road, or straight on."""
    line = borders[n][border]
    line = line if end else line[::-1]
    ahead = _direction(line[::-1])
    best, straightest = None, 0.7
    ways = lane_ends(plan, n, end)
    place = border_ends(source, plan.strips[n].groups[-end].borders[border])[end]
    for lane in (border - 1, border):
        for there in ways[lane] if 0 <= lane < len(ways) else ():
            other = _next_border(there, place, plan, borders, source)
            if other is None:
                continue
            straight = float(-_direction(other) @ ahead)
            if straight > straightest:
                best, straightest = other, straight
    if best is None:
        on: FloatArray = line[-1] + np.array([[*(_ON * ahead), 0.0]])
        return on
    steps = np.linalg.norm(np.diff(best[:, :2], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    kept = best[1:][along[1:] <= _ON]
    if along[-1] > _ON:
        last = [np.interp(_ON, along, best[:, k]) for k in range(3)]
    else:
        rest = _ON - along[-1] + 0.1
        last = best[-1] + np.array([*(rest * _direction(best[::-1])), 0.0])
    return np.concatenate([kept, [last]])


def _next_border(
    there: LaneEnd,
    place: int,
    plan: RoadPlan,
    borders: Sequence[Sequence[FloatArray]],
    source: LaneletMap,
) -> FloatArray | None:
    """The border of a next lane that begins at a place, away from it."""
    group = plan.strips[there.strip].groups[-there.end]
    for number in (there.lane, there.lane + 1):
        if border_ends(source, group.borders[number])[there.end] == place:
            line = borders[there.strip][number]
            return line[::-1] if there.end else line
    return None


def _direction(line: FloatArray) -> FloatArray:
    """Unit vector from a point of a line about 2 m on back to its begin."""
    steps = np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    at = min(2.0, float(along[-1]))
    inner = np.array([np.interp(at, along, line[:, k]) for k in (0, 1)])
    step: FloatArray = line[0, :2] - inner
    return step / max(float(np.hypot(*step)), 1e-9)
