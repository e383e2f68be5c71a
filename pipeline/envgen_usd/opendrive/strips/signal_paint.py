"""Paint of signals: stop lines, crosswalks, arrows (1.8.1, 14.1)."""

import math
from collections.abc import Iterator

import numpy as np
import shapely

from envgen_usd.models.kept_records import Record
from envgen_usd.models.lanes import DRIVEN, Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Origin
from envgen_usd.models.road_surface import Patch
from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.features.name_words import Vocabulary
from envgen_usd.opendrive.features.object_kinds import FLAT, kind_of
from envgen_usd.opendrive.features.roadside_poses import heading_at, points_beside
from envgen_usd.opendrive.features.sign_looks import FLAT as PAINTED
from envgen_usd.opendrive.features.sign_looks import look_of
from envgen_usd.opendrive.features.signal_relations import signal_origin, signal_paint_id
from envgen_usd.opendrive.geometry.lane_borders import lane_borders
from envgen_usd.opendrive.geometry.road_frame import road_points
from envgen_usd.opendrive.lanes.lane_lines import travels_forward
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.object_paint import STOP_LINE, STOP_LINES, is_arrow
from envgen_usd.opendrive.strips.paint_shapes import arrow, painted, zebra

_STOP_CODES = frozenset(("294",))
"""Types of stop lines (Germany, and files that borrow its codes)."""
_CROSSWALK_CODES = frozenset(("1000003", "1000004", "293"))
"""Types of crosswalks: those of the standard (1.4), and the German one."""
_CROSSWALKS = Vocabulary([(True, ("crosswalk", "zebra"))])
_CROSSWALK = 4.0
"""Metres of a crosswalk along the road, where the signal's value tells none (R-FGÜ 2001)."""
_CROSSWALK_BOUNDS = (1.0, 20.0)
"""Metres of a crosswalk along the road that a signal's value can tell."""
_ARROW = (5.0, 1.0)
"""Length and width in metres of an arrow (RMS-1, in towns)."""


def signal_paint_strips(road: Road) -> Iterator[tuple[float, Strip]]:
    """Yields the stop lines, crosswalks and arrows of a road's signals as triangles.

    Yields:
        s of the signal, and a triangle.
    """
    for number, signal in enumerate(road.signals):
        if road.sections and not signal.reference:
            shape, kind = _shape(road, signal)
            origin = signal_origin(road, number)
            patch = _patch(road, origin, kind)
            for strip in painted(shape, patch):
                yield signal.s, strip


def crosswalk_object(road: Road, signal: Signal) -> str:
    """Returns the id of the object that already shows a signal's crosswalk, or an empty string."""
    if not _is_crosswalk(signal):
        return ""
    for each in road.objects:
        kind = kind_of(each)
        crosswalk = kind.template == FLAT and kind.name == "crosswalk"
        if crosswalk and abs(each.s - signal.s) < _depth(signal):
            return each.id or each.type
    return ""


def _shape(road: Road, signal: Signal) -> tuple[shapely.Geometry, str]:
    """Returns the painted shape of a signal in plan, and the kind of its patch."""
    if STOP_LINES.meaning(signal.name) or signal.type in _STOP_CODES:
        return _stop_line(road, signal), "mark"
    if _is_crosswalk(signal) and not crosswalk_object(road, signal):
        return _crosswalk(road, signal), "crosswalk"
    if look_of(signal).template == PAINTED and is_arrow(signal.name):
        return _arrow(road, signal), "mark"
    return shapely.Polygon(), "mark"


def _is_crosswalk(signal: Signal) -> bool:
    named = look_of(signal).template == PAINTED and _CROSSWALKS.meaning(signal.name)
    return signal.type in _CROSSWALK_CODES or bool(named)


def _depth(signal: Signal) -> float:
    """Returns the extent of a signal's crosswalk along the road, metres."""
    low, high = _CROSSWALK_BOUNDS
    told = math.isfinite(signal.value) and low <= signal.value <= high
    return signal.value if told else _CROSSWALK


def _stop_line(road: Road, signal: Signal) -> shapely.Geometry:
    """Returns a bar across all lanes that the signal applies to."""
    s = float(np.clip(signal.s, 0.0, road.length))
    section = _section_at(road, s)
    held = [lane for lane in _lanes(section) if lane.type == "driving"]
    held = [lane for lane in held if _holds(road, lane, signal)]
    low, high = max(s - STOP_LINE / 2, 0.0), min(s + STOP_LINE / 2, road.length)
    return _across(road, section, held, (low, high))


def _crosswalk(road: Road, signal: Signal) -> shapely.Geometry:
    """Returns stripes across all lanes for vehicles; a crosswalk beyond the road moves onto it."""
    half = min(_depth(signal), road.length) / 2
    s = float(np.clip(signal.s, half, road.length - half))
    section = _section_at(road, s)
    crossed = [lane for lane in _lanes(section) if lane.type in DRIVEN]
    area = _across(road, section, crossed, (s - half, s + half))
    heading = float(heading_at(road, np.array([s]))[0])
    across = np.array([-math.sin(heading), math.cos(heading)])
    return zebra(area, across, turned=False) if area.area > 0 else area


def _arrow(road: Road, signal: Signal) -> shapely.Geometry:
    """Returns an arrow in the direction of the traffic that the signal applies to."""
    s = np.array([signal.s])
    (foot,) = points_beside(road, s, np.array([signal.t]), np.zeros(1))
    heading = float(heading_at(road, s)[0]) + signal.heading
    heading += math.pi if signal.orientation == "-" else 0.0
    turn = np.array(
        [(math.cos(heading), math.sin(heading)), (-math.sin(heading), math.cos(heading))]
    )
    shape = arrow(signal.name, *_ARROW)
    return shapely.transform(shape, lambda uv: foot[:2] + uv @ turn)


def _across(
    road: Road, section: LaneSection, lanes: list[Lane], between: tuple[float, float]
) -> shapely.Geometry:
    """Returns the area of lanes between two places s, from the lowest to the highest t."""
    low, high = between
    s = np.array([min((low + high) / 2, section.end - 1e-6)])
    borders = lane_borders(road, section, s)
    ids = {lane.id for lane in lanes}
    t = [borders.t[0, k : k + 2] for k, lane in enumerate(borders.lanes) if lane.id in ids]
    if not t:
        return shapely.Polygon()
    right, left = float(np.min(t)), float(np.max(t))
    corners = road_points(
        road, np.array([low, high, high, low]), np.array([right, right, left, left])
    )
    return shapely.make_valid(shapely.Polygon(corners[:, :2]))


def _section_at(road: Road, s: float) -> LaneSection:
    return next((each for each in reversed(road.sections) if each.s <= s), road.sections[0])


def _lanes(section: LaneSection) -> tuple[Lane, ...]:
    return (*section.left, *section.right)


def _holds(road: Road, lane: Lane, signal: Signal) -> bool:
    forward = travels_forward(road, lane)
    if (signal.orientation == "+" and not forward) or (signal.orientation == "-" and forward):
        return False
    ranges = [record for record in signal.extra if record.tag == "validity"]
    if not ranges:
        return True
    return any(
        _number(record, "fromLane") <= lane.id <= _number(record, "toLane") for record in ranges
    )


def _number(record: Record, name: str) -> float:
    return read(record.attributes.get(name, "0")) or 0.0


def _patch(road: Road, origin: Origin, kind: str) -> Patch:
    return Patch(
        id=signal_paint_id(origin),
        kind=kind,
        lane_type="driving",
        road=road.id,
        junction=road.junction,
        colour="white",
        mark_type="solid" if kind == "mark" else "",
        origin=origin,
    )
