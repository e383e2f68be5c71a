"""Road marks as strips: types, weights, explicit lines, dashes, sway (1.8.1, 11.9)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.lanes import Lane
from envgen_usd.models.road_marks import RoadMark, RoadMarkLine
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.lane_borders import section_points
from envgen_usd.opendrive.strips import SectionGrid, Strip, lane_patch

_WIDTHS = {"standard": 0.12, "bold": 0.25}
_DASHES = {"motorway": (6.0, 12.0)}
_TOWN_DASH = (3.0, 6.0)
"""Dash and gap in metres where the file gives none (lengths usual in Europe)."""
_DOT = (0.1, 1.0)
_UNPAINTED = {"none", "", "curb", "grass", "edge", "custom"}
_NARROWEST, _WIDEST = 0.03, 1.0
_SHORTEST = 0.02


@dataclass(frozen=True)
class _Line:
    """A painted line: its middle beside the border, its width, and its dashes."""

    t_offset: float
    width: float
    dash: float
    gap: float
    start: float
    colour: str
    repeated: bool = True


def mark_strips(grid: SectionGrid) -> Iterator[Strip]:
    """All marks of a section, cut into dashes, each on the outer border of its lane."""
    section, borders = grid.section, grid.borders
    places = [(lane, k if lane.id > 0 else k + 1) for k, lane in enumerate(borders.lanes)]
    places.append((section.centre, len(section.left)))
    for lane, place in places:
        for number, mark in enumerate(lane.marks):
            after = lane.marks[number + 1 :]
            end = min(section.s + after[0].s_offset if after else section.end, section.end)
            start = max(section.s + mark.s_offset, section.s)
            if end - start < _SHORTEST:
                continue
            for index, line in enumerate(_lines(grid, lane, mark)):
                patch = _mark_patch(grid, lane, (number, index), line.colour)
                dashes = _within(_dashes(line, (start, end)), borders.s[0], borders.s[-1])
                yield from _strips_of_line(grid, _painted(place, mark, line), patch, dashes)


def _lines(grid: SectionGrid, lane: Lane, mark: RoadMark) -> list[_Line]:
    """Lines by the explicit ones, else by the type's lines, else by the type's name."""
    width = mark.width if mark.width > 0 else _WIDTHS.get(mark.weight, _WIDTHS["standard"])
    given = [_given_line(line, width, repeated=False) for line in mark.explicit]
    given += [_given_line(line, width, repeated=True) for line in mark.lines]
    if given:
        return [line for line in given if line is not None]
    if mark.type in _UNPAINTED:
        return []
    if mark.type == "botts dots":
        return [_Line(0.0, min(max(width, 0.1), _WIDEST), *_DOT, 0.0, "")]
    kinds = mark.type.split()
    if len(kinds) > 1 and width >= 0.3:
        width /= 2 * len(kinds) - 1
    # Types name their lines from the inside outwards; on the centre lane from left to right.
    outwards = 1.0 if lane.id > 0 else -1.0
    middle = (len(kinds) - 1) / 2
    return [
        _named_line(grid, kind, outwards * (k - middle) * 2 * width, width)
        for k, kind in enumerate(kinds)
    ]


def _given_line(line: RoadMarkLine, width: float, *, repeated: bool) -> _Line | None:
    width = line.width if line.width > 0 else width
    dash, gap = line.length, max(line.space, 0.0)
    if repeated and (dash <= 0 or gap <= 0):
        dash, gap = np.inf, 0.0
    if dash <= 0:
        return None
    width = float(np.clip(width, _NARROWEST, _WIDEST))
    return _Line(line.t_offset, width, dash, gap, line.s_offset, line.colour, repeated)


def _named_line(grid: SectionGrid, kind: str, t_offset: float, width: float) -> _Line:
    dash, gap = np.inf, 0.0
    if kind == "broken":
        types = [entry.type for entry in grid.road.types if entry.s <= grid.section.s]
        dash, gap = _DASHES.get(types[-1] if types else "", _TOWN_DASH)
    return _Line(t_offset, float(np.clip(width, _NARROWEST, _WIDEST)), dash, gap, 0.0, "")


def _dashes(line: _Line, reach: tuple[float, float]) -> list[tuple[float, float]]:
    """(start, end) of each dash on the road."""
    start, end = reach
    if not line.repeated:
        first = start + line.start
        found = [(first, first + line.dash)]
    elif not np.isfinite(line.dash):
        found = [(start + max(line.start, 0.0), end)]
    else:
        period = max(line.dash + line.gap, 0.05)
        begins = np.arange(start + line.start - np.ceil(line.start / period) * period, end, period)
        found = [(begin, begin + line.dash) for begin in begins.tolist()]
    return _within(found, start, end)


def _within(
    dashes: list[tuple[float, float]], start: float, end: float
) -> list[tuple[float, float]]:
    cut = [(max(a, start), min(b, end)) for a, b in dashes]
    return [(a, b) for a, b in cut if b - a >= _SHORTEST]


def _painted(
    place: int, mark: RoadMark, line: _Line
) -> Callable[[SectionGrid, FloatArray], FloatArray]:
    """The line's two edges as t (N x 2) by s (N)."""

    def edges(grid: SectionGrid, s: FloatArray) -> FloatArray:
        borders = grid.borders
        t = np.interp(s, borders.s, borders.t[:, place]) + line.t_offset
        if len(mark.sway.start):
            t = t + mark.sway(s - grid.section.s)
        return np.column_stack([t + line.width / 2, t - line.width / 2])

    return edges


def _strips_of_line(
    grid: SectionGrid,
    edges: Callable[[SectionGrid, FloatArray], FloatArray],
    patch: Patch,
    dashes: list[tuple[float, float]],
) -> Iterator[Strip]:
    """One strip a dash; all dashes are evaluated at once."""
    rows = grid.borders.s
    places = [
        np.clip([a, *rows[(rows > a + 1e-3) & (rows < b - 1e-3)], b], rows[0], rows[-1])
        for a, b in dashes
    ]
    if not places:
        return
    s = np.concatenate(places)
    points = section_points(grid.road, grid.section, s, edges(grid, s))
    for part in np.split(points, np.cumsum([len(place) for place in places])[:-1]):
        flat = np.zeros((len(part), 2))
        yield Strip(part[:, 0], part[:, 1], flat, flat, patch)


def _mark_patch(grid: SectionGrid, lane: Lane, number: tuple[int, int], colour: str) -> Patch:
    base, mark = lane_patch(grid, lane), lane.marks[number[0]]
    return replace(
        base,
        id=f"{base.id}_mark_{number[0]}_{number[1]}",
        kind="mark",
        colour=colour or mark.colour,
        mark_type=mark.type,
        material="",
    )
