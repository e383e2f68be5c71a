"""Bounds on the values of roads; beyond them a file would request a billion samples.

A cubic has at most two turning points, so a cubic within the bounds needs few rows. A bound on
values therefore bounds rows, chunks and memory.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.cubics import Cubics
from envgen_usd.models.lanes import Lane, LaneLayer, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RoadMark
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import HIGHEST, write
from envgen_usd.opendrive.elements.lane_element import lane_id
from envgen_usd.opendrive.elements.lane_section_element import PERMANENT
from envgen_usd.opendrive.geometry.lateral_profile import lateral_height

WIDEST = 250.0
"""Largest distance in metres of a lane border from its reference line.

The widest lane of 134 real and hand-made maps has 20 m. A larger value lets lanes of a curve cover
each other many times over, which takes minutes.
"""
STEEPEST = np.pi / 2
"""Largest superelevation in radians."""
_PROBES = np.linspace(0.0, 1.0, 9)


class _Part(NamedTuple):
    """A piecewise cubic of a road with its domain and limit."""

    cubics: Cubics
    length: float
    limit: float


def repair_bounds(roads: dict[str, Road], index: Index, findings: Findings) -> dict[str, Road]:
    """Replaces pieces of profiles, offsets and widths beyond the bounds by constants.

    Args:
        roads: Roads by id.
        index: XML elements; repaired in place.
        findings: Collects the issues.

    Returns:
        The roads, within `WIDEST` of their reference lines and `HIGHEST` of 0.
    """
    owned = [(id_, part) for id_, road in roads.items() for part in _parts(road)]
    parts = [part for _, part in owned]
    far = _beyond(parts)
    wrong = {id_ for (id_, _), bad in zip(owned, far, strict=True) if bad}
    repaired = dict(roads)
    for id_, road in roads.items():
        if id_ in wrong:
            repaired[id_] = _RoadRepair(index.roads[id_], findings).road(road)
        if road.shapes is not None or road.cross_section is not None:
            repaired[id_] = _lateral(repaired[id_], index.roads[id_], findings)
    return repaired


def _parts(road: Road) -> Iterator[_Part]:
    yield _Part(road.elevation, road.length, HIGHEST)
    yield _Part(road.superelevation, road.length, STEEPEST)
    yield _Part(road.lane_offset, road.length, WIDEST)
    for section in road.sections:
        yield from _section_parts(section)
    for layer in road.layers:
        yield _Part(layer.lane_offset, _end(layer), WIDEST)
        for section in layer.sections:
            yield from _section_parts(section)


def _end(layer: LaneLayer) -> float:
    """Returns the end of a layer; its cubics may exceed the bounds beyond it."""
    return max((section.end for section in layer.sections), default=0.0)


def _section_parts(section: LaneSection) -> Iterator[_Part]:
    length = section.end - section.s
    for lanes in (section.left, section.right):
        # The lanes of a side share the largest width of a road.
        limit = WIDEST / max(len(lanes) / 4, 1.0)
        for lane in lanes:
            yield _Part(lane.width, length, limit)
            if len(lane.border.start):
                yield _Part(lane.border, length, WIDEST)
    for lane in (*section.left, section.centre, *section.right):
        yield from (_Part(mark.sway, length, WIDEST) for mark in lane.marks if len(mark.sway.start))


def _beyond(parts: Sequence[_Part]) -> list[bool]:
    """Returns for each part whether a value exceeds its limit, in a single evaluation."""
    counts = np.array([len(part.cubics.start) for part in parts])
    owner = np.repeat(np.arange(len(parts)), counts)
    start = np.concatenate([part.cubics.start for part in parts])
    table = np.concatenate([part.cubics.coefficients for part in parts])
    length = np.array([part.length for part in parts])[owner]
    limit = np.array([part.limit for part in parts])[owner]
    following = np.append(owner[1:] == owner[:-1], False)
    end = np.where(following, np.append(start[1:], 0.0), length)
    first = np.append(True, owner[1:] != owner[:-1])[: len(owner)]
    bad = _peaks(start, table, np.where(first, 0.0, start), np.minimum(end, length)) > limit
    beyond: list[bool] = (np.bincount(owner[bad], minlength=len(parts)) > 0).tolist()
    return beyond


def _peaks(start: FloatArray, table: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Returns the largest magnitude of each cubic from low to high; 0 for an empty interval."""
    low = np.maximum(low, 0.0)
    ds = (low - start)[:, None] + np.maximum(high - low, 0.0)[:, None] * _PROBES
    a, b, c, d = table.T[:, :, None]
    peaks: FloatArray = np.abs(a + ds * (b + ds * (c + ds * d))).max(axis=1)
    return np.where(high >= low, peaks, 0.0)


class _RoadRepair:
    """Repairs all cubics of a road."""

    def __init__(self, element: Element, findings: Findings) -> None:
        self._element = element
        self._findings = findings

    def road(self, road: Road) -> Road:
        """Returns the road with each piece beyond the bounds as a constant."""
        child = self._element.iterfind
        groups = list(child("lanes"))
        lanes = next(each for each in groups if each.get("layer", PERMANENT) == PERMANENT)
        others = [each for each in groups if each is not lanes]
        elevation = list(child("elevationProfile/elevation"))
        tilt = list(child("lateralProfile/superelevation"))
        layers = tuple(
            replace(
                layer,
                lane_offset=self._offset(layer.lane_offset, _end(layer), group),
                sections=self._sections(layer.sections, group),
            )
            for layer, group in zip(road.layers, others, strict=True)
        )
        return replace(
            road,
            elevation=self._bounded(_Part(road.elevation, road.length, HIGHEST), elevation),
            superelevation=self._bounded(_Part(road.superelevation, road.length, STEEPEST), tilt),
            lane_offset=self._offset(road.lane_offset, road.length, lanes),
            sections=self._sections(road.sections, lanes),
            layers=layers,
        )

    def _offset(self, offset: Cubics, length: float, lanes: Element) -> Cubics:
        return self._bounded(_Part(offset, length, WIDEST), list(lanes.iterchildren("laneOffset")))

    def _sections(
        self, sections: tuple[LaneSection, ...], lanes: Element
    ) -> tuple[LaneSection, ...]:
        elements = list(lanes.iterchildren("laneSection"))
        return tuple(
            self._section(section, element)
            for section, element in zip(sections, elements, strict=True)
        )

    def _section(self, section: LaneSection, element: Element) -> LaneSection:
        elements = {
            lane_id(lane.get("id", "")): lane
            for side in element.iterchildren("left", "center", "right")
            for lane in side.iterchildren("lane")
        }
        length = section.end - section.s

        def side(lanes: tuple[Lane, ...]) -> tuple[Lane, ...]:
            limit = WIDEST / max(len(lanes) / 4, 1.0)
            return tuple(self._lane(lane, elements.get(lane.id), length, limit) for lane in lanes)

        centre = self._lane(section.centre, elements.get(0), length, WIDEST)
        return replace(section, left=side(section.left), centre=centre, right=side(section.right))

    def _lane(self, lane: Lane, element: Element | None, length: float, limit: float) -> Lane:
        """Bounds a lane; a lane without an element continues a previous section."""
        widths, borders, marks = (
            [] if element is None else list(element.iterchildren(tag))
            for tag in ("width", "border", "roadMark")
        )
        marks.sort(key=lambda mark: float(mark.get("sOffset", "0")))
        return replace(
            lane,
            width=self._bounded(_Part(lane.width, length, limit), widths),
            border=self._bounded(_Part(lane.border, length, WIDEST), borders),
            marks=tuple(
                self._mark(mark, marks[place] if place < len(marks) else None, length)
                for place, mark in enumerate(lane.marks)
            ),
        )

    def _mark(self, mark: RoadMark, element: Element | None, length: float) -> RoadMark:
        sways = [] if element is None else list(element.iterchildren("sway"))
        return replace(mark, sway=self._bounded(_Part(mark.sway, length, WIDEST), sways))

    def _bounded(self, part: _Part, elements: Sequence[Element]) -> Cubics:
        """Replaces pieces beyond the limit by their value at the start, or by 0."""
        start, table = part.cubics.start, part.cubics.coefficients
        if not len(start) or not _beyond([part])[0]:
            return part.cubics
        if start[0] > 0:
            # Before a late first piece its first value applies, so the cubic is not extended.
            before = [[table[0, 0], 0.0, 0.0, 0.0]]
            held = Cubics(np.append(0.0, start), np.concatenate([before, table]))
            if not _beyond([part._replace(cubics=held)])[0]:
                return held
        low, high = np.append(0.0, start[1:]), np.append(start[1:], part.length)
        peaks = _peaks(start, table, low, np.minimum(high, part.length))
        table = table.copy()
        for place in np.flatnonzero(peaks > part.limit).tolist():
            value = float(table[place, 0])
            table[place] = value if abs(value) <= part.limit else 0.0, 0.0, 0.0, 0.0
            if place < len(elements):
                self._write(elements[place], peaks[place], table[place].tolist(), part.limit)
        return Cubics(start, table)

    def _write(self, element: Element, peak: float, row: list[float], limit: float) -> None:
        text = f"{element.tag} reaches {peak:.3g}; the limit is {limit:g}"
        action = f"set to constant {row[0]:g}"
        self._findings.repaired("number.beyond_bounds", element, text, action, Severity.ERROR)
        for name, value in zip("abcd", row, strict=True):
            element.set(name, write(value))


def _lateral(road: Road, element: Element, findings: Findings) -> Road:
    """Removes a lateral profile that exceeds the largest elevation."""
    reach = 2 * WIDEST if not road.sections else _reach(road)
    s = np.repeat(np.linspace(0.0, road.length, 33), 33)
    t = np.tile(np.linspace(-reach, reach, 33), 33)
    peak = float(np.nan_to_num(np.abs(lateral_height(road, s, t)), nan=np.inf).max())
    if peak <= WIDEST:
        return road
    for tag in ("shape", "crossSectionSurface"):
        for each in list(element.iterfind(f"lateralProfile/{tag}")):
            text = f"the lateral profile reaches {peak:.3g} m"
            findings.repaired("number.beyond_bounds", each, text, "left out", Severity.ERROR)
            remove(each)
    return replace(road, shapes=None, cross_section=None)


def _reach(road: Road) -> float:
    """Returns a lower bound of the outermost border's distance from the reference line, metres."""
    reach = 0.0
    for section in road.sections:
        s = np.linspace(0.0, section.end - section.s, 5)
        offset = np.abs(road.lane_offset(s + section.s)).max()
        for lanes in (section.left, section.right):
            borders = [np.abs(lane.border(s)).max() for lane in lanes]
            widths = sum(float(np.abs(lane.width(s)).max()) for lane in lanes)
            reach = max(reach, float(offset) + widths, *map(float, borders), 0.0)
    return reach
