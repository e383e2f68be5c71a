"""The shape of each road of lanelets: reference line and borders between its seams."""

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanelet_map import LaneletMap
from envgen_usd.streets.lanelets.border_profiles import RoadShape, road_shape
from envgen_usd.streets.lanelets.lane_groups import border_ends, vehicle_span
from envgen_usd.streets.lanelets.reference_curves import OVERHANG, crossing, reference_curve
from envgen_usd.streets.lanelets.road_seams import Seam, lane_ends, road_seams, strip_borders
from envgen_usd.streets.lanelets.road_strips import LaneEnd, RoadPlan


def strip_shapes(plan: RoadPlan, source: LaneletMap) -> list[RoadShape]:
    """Reference line and borders of each road."""
    borders = [strip_borders(strip, source) for strip in plan.strips]
    seams = road_seams(plan, borders, source)
    lines = [
        [_extended(n, k, plan, borders, source) for k in range(len(borders[n]))]
        for n in range(len(plan.strips))
    ]
    ends = _border_ends(plan, lines, seams, source)
    return [_shape(n, plan, lines[n], seams, ends, source) for n in range(len(plan.strips))]


def section_ends(n: int, plan: RoadPlan, shape: RoadShape, source: LaneletMap) -> tuple[float, ...]:
    """S at which each group of a road ends."""
    strip, length = plan.strips[n], shape.curve.length
    line = strip_borders(strip, source)[strip.groups[0].divider]
    located = shape.curve.located(line[:, :2], 0.0)[0]
    sizes = [len(source.lines[group.borders[group.divider].line].points) for group in strip.groups]
    ends: list[float] = []
    for last in np.cumsum(np.array(sizes) - 1)[:-1].tolist():
        before = ends[-1] if ends else 0.0
        ends.append(float(np.clip(located[last], before + 0.01, max(length - 0.01, before + 0.01))))
    return (*ends, length)


def _shape(  # noqa: PLR0913, PLR0917 - what a shape follows from
    n: int,
    plan: RoadPlan,
    lines: Sequence[FloatArray],
    seams: Mapping[tuple[int, int], Seam],
    ends: Mapping[tuple[int, int], FloatArray],
    source: LaneletMap,
) -> RoadShape:
    group = plan.strips[n].groups[0]
    cuts, t = (seams[n, 0], seams[n, 1]), (ends[n, 0], ends[n, 1])
    divider = float(t[0][group.divider]), float(t[1][group.divider])
    curve = reference_curve(lines[group.divider][:, :2], cuts, divider)
    paved = vehicle_span(group, source) or (0, len(lines) - 1)
    return road_shape(curve, lines, cuts, (t[0] - divider[0], t[1] - divider[1]), paved)


def _border_ends(
    plan: RoadPlan,
    lines: Sequence[Sequence[FloatArray]],
    seams: Mapping[tuple[int, int], Seam],
    source: LaneletMap,
) -> dict[tuple[int, int], FloatArray]:
    """Where borders end on the seams: t from the middle of the seam, from left to right.

    Borders that end at one place of the map end at one t: the mean of roads outside of junctions,
    of all where there is none. So lanes that follow each other meet.
    """
    own: dict[tuple[int, int], FloatArray] = {}
    found: dict[tuple[bytes, int], list[tuple[bool, float]]] = defaultdict(list)
    for (n, end), seam in seams.items():
        places = (crossing(line[:, :2], end, seam)[0] for line in lines[n])
        own[n, end] = np.array([float((place - seam.place) @ seam.left) for place in places])
        keys = _keys(n, end, plan, seam, source)
        for key, t in zip(keys, own[n, end].tolist(), strict=True):
            found[key].append((plan.strips[n].junction < 0, seam.side * t))
    shared = {}
    for key, several in found.items():
        outside = [t for is_outside, t in several if is_outside]
        shared[key] = float(np.mean(outside or [t for _, t in several]))
    for (n, end), seam in seams.items():
        t = [seam.side * shared[key] for key in _keys(n, end, plan, seam, source)]
        own[n, end] = np.minimum.accumulate(t)
    return own


def _keys(
    n: int, end: int, plan: RoadPlan, seam: Seam, source: LaneletMap
) -> list[tuple[bytes, int]]:
    """Seam and place of each border's end."""
    borders = plan.strips[n].groups[-end].borders
    return [(seam.place.tobytes(), border_ends(source, border)[end]) for border in borders]


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
        on: FloatArray = line[-1] + np.array([[*(OVERHANG * ahead), 0.0]])
        return on
    steps = np.linalg.norm(np.diff(best[:, :2], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    kept = best[1:][along[1:] <= OVERHANG]
    if along[-1] > OVERHANG:
        last = [np.interp(OVERHANG, along, best[:, k]) for k in range(3)]
    else:
        rest = OVERHANG - along[-1] + 0.1
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
