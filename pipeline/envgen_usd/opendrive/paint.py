"""Paint and bays that objects and signals put on the road (1.8.1, 13.8, 13.9 and 14)."""

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import shapely
import shapely.ops

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.records import Record
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Outline, RoadObject
from envgen_usd.models.signals import Signal
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.elements.numbers import read
from envgen_usd.opendrive.features.instances import Instance, instances
from envgen_usd.opendrive.features.outlines import outer_rings
from envgen_usd.opendrive.features.signal_relations import signal_paint_id
from envgen_usd.opendrive.lane_borders import lane_borders
from envgen_usd.opendrive.lane_lines import travels_forward
from envgen_usd.opendrive.names import nc_name
from envgen_usd.opendrive.paint_shapes import arrow, dashes, painted, zebra
from envgen_usd.opendrive.plan_view import evaluate
from envgen_usd.opendrive.road_frame import road_points
from envgen_usd.opendrive.strips import Strip, triangle_strip

_STOP_LINE = 0.4
_STOP_LINES = re.compile(r"stop_?line|holding_?line|haltlinie", re.IGNORECASE)
_STOP_CODE = {"294"}
"""Codes of stop lines (Germany and files that borrow its codes)."""
_BAY_KINDS = {"parkingspace", "parking"}
_SIDES: Mapping[str, tuple[int, int]] = {
    "left": (1, 2),
    "right": (3, 0),
    "front": (0, 1),
    "rear": (2, 3),
}
"""Corners of an object's rectangle at the ends of each of its sides."""


def paint_strips(road: Road) -> Iterator[tuple[float, Strip]]:
    """Crosswalks, parking bays, arrows, stop lines and the lines of objects, in triangles.

    Paint counts wherever a lane lies; a bay is surface of its own where nothing else lies.

    Yields:
        The place s of the object or signal, and one triangle.
    """
    for thing in road.objects:
        for number, instance in enumerate(_flat(road, thing)):
            name = f"paint_object_{nc_name(road.id)}_{nc_name(thing.id)}_{number}"
            for strip in _of_object(road, instance, name):
                yield instance.thing.s, strip
    for signal in road.signals:
        if _STOP_LINES.search(signal.name) or signal.type in _STOP_CODE:
            for strip in _stop_line(road, signal):
                yield signal.s, strip


def _flat(road: Road, thing: RoadObject) -> Iterator[Instance]:
    kind = thing.type.lower()
    marked = any(record.tag == "markings" for record in thing.extra)
    if kind in {"crosswalk", "roadmark", *_BAY_KINDS} or marked:
        yield from instances(road, thing)


def _of_object(road: Road, instance: Instance, name: str) -> Iterator[Strip]:
    thing = instance.thing
    rings = outer_rings(road, instance)
    areas = [_area(ring) for ring in rings]
    lines = list(_marking_lines(instance, rings))
    kind = thing.type.lower()
    if kind == "crosswalk":
        yield from _crosswalk(road, instance, areas, name, bare=bool(lines))
    # Later paint lies over what was there, so that lines are seen on a crosswalk.
    for number, (shape, colour) in enumerate(lines):
        yield from painted(shape, _patch(f"{name}_line_{number}", road, "mark", colour))
    if kind == "roadmark" and not lines:
        for number, shape in enumerate(_symbols(instance, areas)):
            yield from painted(shape, _patch(f"{name}_{number}", road, "mark", "white"))
    elif kind in _BAY_KINDS:
        for number, ring in enumerate(rings):
            yield from _bay(ring, _patch(f"{name}_bay_{number}", road, "filler", ""))


def _crosswalk(
    road: Road, instance: Instance, areas: Sequence[shapely.Geometry], name: str, *, bare: bool
) -> Iterator[Strip]:
    """Where people walk: stripes, or the bare road between the lines that the file draws."""
    heading = evaluate(road.plan_view, np.array([instance.thing.s]))[2]
    across = np.concatenate([-np.sin(heading), np.cos(heading)])
    for number, area in enumerate(areas):
        colour = "" if bare else "white"
        patch = _patch(f"{name}_crosswalk_{number}", road, "crosswalk", colour)
        yield from painted(area if bare else zebra(area, across), patch)


def _area(ring: FloatArray) -> shapely.Geometry:
    return shapely.make_valid(shapely.Polygon(ring[:, :2]))


def _symbols(instance: Instance, areas: Sequence[shapely.Geometry]) -> list[shapely.Geometry]:
    """What a road mark shows: its outline, or the arrow that its name tells."""
    thing = instance.thing
    words = f"{thing.subtype} {thing.name}"
    if thing.outlines or "arrow" not in words.lower():
        return list(areas)
    kind = thing.subtype if "arrow" in thing.subtype.lower() else thing.name
    shape = arrow(kind, thing.length or 4.0, thing.width or 0.6)
    return [shapely.transform(shape, lambda uv: _placed(instance, uv))]


def _placed(instance: Instance, local: FloatArray) -> FloatArray:
    return instance.stand.places(np.column_stack([local, np.zeros(len(local))]))[:, :2]


def _marking_lines(
    instance: Instance, rings: Sequence[FloatArray]
) -> Iterator[tuple[shapely.Geometry, str]]:
    """Lines of the object's markings (13.8) with their colours."""
    for record in instance.thing.extra:
        if record.tag != "markings":
            continue
        for marking in record.children:
            path = _marking_path(instance.thing, marking, rings)
            if path is None:
                continue
            start, stop = _number(marking, "startOffset"), _number(marking, "stopOffset")
            length = float(np.hypot(*np.diff(path, axis=0).T).sum())
            if length - start - stop <= 0.01:
                continue
            line = shapely.ops.substring(shapely.LineString(path), start, length - stop)
            width = float(np.clip(_number(marking, "width") or 0.1, 0.03, 1.0))
            pattern = _number(marking, "lineLength"), _number(marking, "spaceLength")
            shape = dashes(shapely.get_coordinates(line), pattern, width)
            yield shape, marking.attributes.get("color", "standard")


def _marking_path(
    thing: RoadObject, marking: Record, rings: Sequence[FloatArray]
) -> FloatArray | None:
    """Through the referenced corners, or along a side of the object's rectangle."""
    wanted = [
        child.attributes.get("id", "")
        for child in marking.children
        if child.tag == "cornerReference"
    ]
    if wanted and thing.outlines:
        places = {
            corner: ring[k, :2]
            for outline, ring in zip(_outer(thing), rings, strict=False)
            for k, corner in enumerate(outline.ids)
        }
        path = [places[corner] for corner in wanted if corner in places]
        return np.array(path) if len(path) > 1 else None
    side = _SIDES.get(marking.attributes.get("side", ""))
    if side is None or not rings or len(rings[0]) < 4:
        return None
    path_along: FloatArray = rings[0][list(side), :2]
    return path_along


def _outer(thing: RoadObject) -> list[Outline]:
    return [outline for outline in thing.outlines if outline.outer and len(outline.points) > 2]


def _number(record: Record, name: str) -> float:
    return read(record.attributes.get(name, "0")) or 0.0


def _stop_line(road: Road, signal: Signal) -> Iterator[Strip]:
    """A bar across all lanes for whose traffic the signal holds."""
    if not road.sections:
        return
    s = float(np.clip(signal.s, 0.0, road.length))
    section = [one for one in road.sections if one.s <= s][-1:] or list(road.sections[:1])
    reach = _lanes_held(road, section[0], signal, s)
    if reach is None:
        return
    low, high = max(s - _STOP_LINE / 2, 0.0), min(s + _STOP_LINE / 2, road.length)
    t = np.array([reach[0], reach[0], reach[1], reach[1]])
    ring = road_points(road, np.array([low, high, high, low]), t)
    patch = _patch(signal_paint_id(road, signal), road, "mark", "white")
    yield from painted(_area(ring), patch)


def _lanes_held(
    road: Road, section: LaneSection, signal: Signal, s: float
) -> tuple[float, float] | None:
    """Lowest and highest t of the lanes for which a signal holds."""
    borders = lane_borders(road, section, np.array([min(s, section.end - 1e-6)]))
    held = [
        borders.t[0, k : k + 2]
        for k, lane in enumerate(borders.lanes)
        if lane.type == "driving" and _holds(road, lane, signal)
    ]
    if not held:
        return None
    return float(np.min(held)), float(np.max(held))


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


def _bay(ring: FloatArray, patch: Patch) -> Iterator[Strip]:
    """A bay as surface, with the heights of its corners."""
    area = shapely.Polygon(ring)
    if not area.is_valid or area.area < 0.5:
        return
    for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(area)):
        corner = shapely.get_coordinates(triangle, include_z=True)[:3]
        corner[:, 2] = _heights_at(ring, corner[:, :2])
        yield triangle_strip(corner, patch)


def _heights_at(ring: FloatArray, places: FloatArray) -> FloatArray:
    apart = np.hypot(*(places[:, None] - ring[None, :, :2]).T).T
    heights: FloatArray = ring[np.argmin(apart, axis=1), 2]
    return heights


def _patch(name: str, road: Road, kind: str, colour: str) -> Patch:
    return Patch(
        id=name,
        kind=kind,
        lane_type="parking" if kind == "filler" else "driving",
        road=road.id,
        junction=road.junction,
        colour=colour,
        mark_type="solid" if kind == "mark" else "",
    )
