"""Strips of road marks: types, weights, explicit lines, dashes, sway (1.8.1, 11.9)."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.flat_arrays import spans
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.lanes import Lane
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules, RoadMark, RoadMarkLine
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.geometry.lane_borders import section_points
from envgen_usd.opendrive.geometry.section_grids import SectionGrid
from envgen_usd.opendrive.strips.lane_strips import Strip, lane_patch

_DOT = (0.1, 1.0)
"""Dash and gap in metres of Botts' dots."""
_UNPAINTED = {"none", "", "curb", "grass", "edge", "custom"}
_NARROWEST_DOT = 0.1
"""Least width of Botts' dots in metres."""
_WIDEST_OF_ONE = 0.3
"""Width above which the width of a mark of several lines includes their gaps, metres."""
_SHORTEST = 0.02
"""Length in metres below which a dash is left out."""
_LEAST_STEP = 0.01
"""Height of a kerb in metres from which a mark lies at its foot."""


@dataclass(frozen=True)
class _Line:
    """A painted line: offset of its centre from the border, its width, and its dashes."""

    t_offset: float
    width: float
    dash: float
    gap: float
    start: float
    colour: str
    repeated: bool = True


class _Painted(NamedTuple):
    """A line of a mark along a border, its move aside in metres, and its number of dashes."""

    patch: Patch
    place: int
    mark: RoadMark
    line: _Line
    aside: float
    dashes: int


def mark_strips(grid: SectionGrid, rules: MarkRules = RMS_MARKS) -> Iterator[Strip]:
    """All marks of a section, cut into dashes, each on the outer border of its lane.

    A mark is centred on the border, but at a kerb it lies whole at the kerb's foot: nobody paints
    half a line on the sidewalk.

    Args:
        grid: The section.
        rules: Sizes of what the file leaves open.
    """
    section, borders = grid.section, grid.borders
    places = [(lane, k if lane.id > 0 else k + 1) for k, lane in enumerate(borders.lanes)]
    places.append((section.centre, len(section.left)))
    painted = []
    dashes: list[tuple[float, float]] = []
    for lane, place in places:
        base = lane_patch(grid, lane)
        for number, mark in enumerate(lane.marks):
            after = lane.marks[number + 1 :]
            end = min(section.s + after[0].s_offset if after else section.end, section.end)
            start = max(section.s + mark.s_offset, section.s)
            if end - start < _SHORTEST:
                continue
            lines = _lines(grid, lane, mark, rules)
            aside = _aside(lines, _step(grid, place, (start, end)))
            for index, line in enumerate(lines):
                drawn = _within(_dashes(line, (start, end)), *borders.s[[0, -1]].tolist())
                if drawn:
                    patch = _mark_patch(base, mark, (number, index), line.colour)
                    painted.append(_Painted(patch, place, mark, line, aside, len(drawn)))
                    dashes += drawn
    if painted:
        yield from _strips(grid, painted, np.array(dashes))


def unsized_marks(network: RoadNetwork) -> Iterator[Issue]:
    """Yields an issue if the file leaves sizes of marks open."""
    marks = [
        mark
        for road in network.roads.values()
        for section in road.sections
        for lane in (*section.left, section.centre, *section.right)
        for mark in lane.marks
        if mark.type not in _UNPAINTED and not mark.explicit
    ]
    narrow = sum(mark.width <= 0 and not any(line.width > 0 for line in mark.lines)
                 for mark in marks)  # fmt: skip
    broken = sum("broken" in mark.type.split() and not mark.lines for mark in marks)
    if narrow or broken:
        text = f"of {len(marks)} marks, {narrow} have no width; the dashes of {broken} no length"
        yield Issue("road_mark.size", Severity.INFO, "road/lanes", text, "sized by the environment")


def _lines(grid: SectionGrid, lane: Lane, mark: RoadMark, rules: MarkRules) -> list[_Line]:
    """Lines by the explicit ones, else by the type's lines, else by the type's name."""
    width = mark.width if mark.width > 0 else rules.line_width(mark.weight)
    given = [_given_line(line, width, repeated=False) for line in mark.explicit]
    given += [_given_line(line, width, repeated=True) for line in mark.lines]
    if given:
        return [line for line in given if line is not None]
    if mark.type in _UNPAINTED:
        return []
    if mark.type == "botts dots":
        return [_Line(0.0, max(width, _NARROWEST_DOT), *_DOT, 0.0, "")]
    kinds = mark.type.split()
    if len(kinds) > 1 and mark.width >= _WIDEST_OF_ONE:
        width /= 2 * len(kinds) - 1
    dash = rules.dashes(_road_type(grid))
    # A type lists its lines from the inside outwards; on the centre lane from left to right.
    outwards = 1.0 if lane.id > 0 else -1.0
    middle = (len(kinds) - 1) / 2
    return [
        _named_line(kind, outwards * (k - middle) * 2 * width, width, dash)
        for k, kind in enumerate(kinds)
    ]


def _given_line(line: RoadMarkLine, width: float, *, repeated: bool) -> _Line | None:
    width = line.width if line.width > 0 else width
    dash, gap = line.length, max(line.space, 0.0)
    if repeated and (dash <= 0 or gap <= 0):
        dash, gap = np.inf, 0.0
    if dash <= 0:
        return None
    return _Line(line.t_offset, width, dash, gap, line.s_offset, line.colour, repeated)


def _named_line(kind: str, t_offset: float, width: float, dashes: tuple[float, float]) -> _Line:
    dash, gap = dashes if kind == "broken" else (np.inf, 0.0)
    return _Line(t_offset, width, dash, gap, 0.0, "")


def _road_type(grid: SectionGrid) -> str:
    """Type of the road where a section begins; empty where the file gives none."""
    types = [entry.type for entry in grid.road.types if entry.s <= grid.section.s]
    return types[-1] if types else ""


def _dashes(line: _Line, reach: tuple[float, float]) -> list[tuple[float, float]]:
    """Returns (start, end) of each dash on the road, metres."""
    start, end = reach
    if not line.repeated:
        first = start + line.start
        intervals = [(first, first + line.dash)]
    elif not np.isfinite(line.dash):
        intervals = [(start + max(line.start, 0.0), end)]
    else:
        period = max(line.dash + line.gap, 0.05)
        begins = np.arange(start + line.start - np.ceil(line.start / period) * period, end, period)
        intervals = [(begin, begin + line.dash) for begin in begins.tolist()]
    return _within(intervals, start, end)


def _within(
    dashes: list[tuple[float, float]], start: float, end: float
) -> list[tuple[float, float]]:
    cut = [(max(a, start), min(b, end)) for a, b in dashes]
    return [(a, b) for a, b in cut if b - a >= _SHORTEST]


def _rows_of_dashes(rows: FloatArray, dashes: FloatArray) -> tuple[FloatArray, IntArray]:
    """Returns the s of both ends of dashes (D x 2) and of the rows between; their number, D."""
    first = np.searchsorted(rows, dashes[:, 0] + 1e-3, side="right")
    between = np.maximum(np.searchsorted(rows, dashes[:, 1] - 1e-3, side="left") - first, 0)
    count = between + 2
    begin = np.cumsum(count) - count
    s = np.empty(count.sum())
    inner = np.ones(len(s), dtype=bool)
    inner[begin] = inner[begin + count - 1] = False
    s[begin], s[begin + count - 1] = dashes[:, 0], dashes[:, 1]
    s[inner] = rows[spans(first, between)]
    return np.clip(s, rows[0], rows[-1]), count


def _step(grid: SectionGrid, place: int, reach: tuple[float, float]) -> float:
    """The largest step up from the right to the left of a border, metres; below 0: down."""
    borders = grid.borders
    if not 0 < place < len(borders.lanes):
        return 0.0
    # From the row at the mark's start on, which rounding may put just before it.
    first = max(int(np.searchsorted(borders.s, reach[0], side="right")) - 1, 0)
    rows = slice(first, max(int(np.searchsorted(borders.s, reach[1])), first + 1))
    steps = (borders.height_right[:, place - 1] - borders.height_left[:, place])[rows]
    return float(steps[np.abs(steps).argmax()])


def _aside(lines: Sequence[_Line], step: float) -> float:
    """How far a mark's lines move to the left to lie at the foot of a step, metres."""
    if not lines or abs(step) < _LEAST_STEP:
        return 0.0
    if step > 0:
        return -max(line.t_offset + line.width / 2 for line in lines)
    return -min(line.t_offset - line.width / 2 for line in lines)


def _middle(grid: SectionGrid, painted: _Painted, s: FloatArray) -> FloatArray:
    """Returns the t of the middle of a line at s (N), N."""
    borders, sway = grid.borders, painted.mark.sway
    t: FloatArray = np.interp(s, borders.s, borders.t[:, painted.place])
    t = t + (painted.line.t_offset + painted.aside)
    return t + sway(s - grid.section.s) if len(sway.start) else t


def _strips(grid: SectionGrid, painted: Sequence[_Painted], dashes: FloatArray) -> Iterator[Strip]:
    """Yields a strip for each dash (D x 2, start and end in metres) of lines, line by line."""
    s, rows = _rows_of_dashes(grid.borders.s, dashes)
    counts = [each.dashes for each in painted]
    ends = np.cumsum(rows)
    cuts = ends[np.cumsum(counts)[:-1] - 1]
    parts = zip(painted, np.split(s, cuts), strict=True)
    middle = np.concatenate([_middle(grid, each, part) for each, part in parts])
    widths = np.repeat([each.line.width for each in painted], counts)
    aside = np.repeat(widths, rows) / 2
    points = section_points(
        grid.road, grid.section, s, np.column_stack([middle + aside, middle - aside])
    )
    flat = np.zeros((len(s), 2))
    patches = itertools.chain.from_iterable([each.patch] * each.dashes for each in painted)
    for patch, begin, end in zip(patches, (ends - rows).tolist(), ends.tolist(), strict=True):
        part, level = points[begin:end], flat[begin:end]
        yield Strip(part[:, 0], part[:, 1], level, level, patch)


def _mark_patch(lane: Patch, mark: RoadMark, number: tuple[int, int], colour: str) -> Patch:
    return Patch(
        id=f"{lane.id}_mark_{number[0]}_{number[1]}",
        kind="mark",
        lane_type=lane.lane_type,
        road=lane.road,
        section=lane.section,
        lane=lane.lane,
        junction=lane.junction,
        colour=colour or mark.colour,
        mark_type=mark.type,
    )
