"""Paint and parking bays from objects and signals (1.8.1, 13.8, 13.9 and 14)."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import shapely
import shapely.ops

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.kept_records import Record
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.models.road_objects import Outline, RoadObject
from envgen_usd.models.road_surface import Patch
from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.features.name_words import Vocabulary, words_of
from envgen_usd.opendrive.features.object_instances import Instance, instances
from envgen_usd.opendrive.features.object_outlines import outer_rings
from envgen_usd.opendrive.features.signal_relations import signal_paint_id
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.geometry.lane_borders import lane_borders
from envgen_usd.opendrive.geometry.road_frame import road_points
from envgen_usd.opendrive.lanes.lane_lines import travels_forward
from envgen_usd.opendrive.strips.lane_strips import Strip, triangle_strip
from envgen_usd.opendrive.strips.paint_shapes import arrow, dashes, painted, zebra
from envgen_usd.opendrive.surface_ids import nc_name

_STOP_LINE = 0.4
"""Width of a stop line in metres along the road."""
_STOP_LINES = Vocabulary([(True, ("stop line", "holding line", "halt linie"))])
_ARROWS = ("arrow", "leftarrow", "rightarrow", "straightarrow")
"""Begins of words for arrows; ``narrow`` is no arrow."""
_STOP_CODE = {"294"}
"""Signal codes of stop lines (Germany, and files that borrow its codes)."""
_BAY_KINDS = {"parkingspace", "parking"}
_SIDES: Mapping[str, tuple[int, int]] = {
    "left": (1, 2),
    "right": (3, 0),
    "front": (0, 1),
    "rear": (2, 3),
}
"""Corner indices of an object's rectangle at the ends of each side."""


def paint_strips(road: Road, rules: MarkRules = RMS_MARKS) -> Iterator[tuple[float, Strip]]:
    """Yields crosswalks, parking bays, arrows, stop lines and object markings as triangles.

    Paint applies on all lanes; a parking bay is a surface with the lowest precedence.

    Args:
        road: The road.
        rules: Sizes of lines of objects where the file leaves them open.

    Yields:
        s of the object or signal, and a triangle.
    """
    for road_object in road.objects:
        for number, instance in enumerate(_flat(road, road_object)):
            name = f"paint_object_{nc_name(road.id)}_{nc_name(road_object.id)}_{number}"
            for strip in _of_object(road, instance, name, rules):
                yield instance.road_object.s, strip
    for signal in road.signals:
        if _STOP_LINES.meaning(signal.name) or signal.type in _STOP_CODE:
            for strip in _stop_line(road, signal):
                yield signal.s, strip


def _flat(road: Road, road_object: RoadObject) -> Iterator[Instance]:
    kind = road_object.type.lower()
    marked = any(record.tag == "markings" for record in road_object.extra)
    if kind in {"crosswalk", "roadmark", *_BAY_KINDS} or marked:
        yield from instances(road, road_object)


def _of_object(road: Road, instance: Instance, name: str, rules: MarkRules) -> Iterator[Strip]:
    road_object = instance.road_object
    rings = outer_rings(road, instance)
    areas = [_area(ring) for ring in rings]
    lines = list(_marking_lines(instance, rings, rules))
    kind = road_object.type.lower()
    if kind == "crosswalk":
        yield from _crosswalk(road, instance, areas, name, bare=bool(lines))
        # Later paint covers earlier paint, so lines stay visible on a crosswalk.
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
    """Yields the stripes of a crosswalk, or the bare road between the lines of the file."""
    heading = evaluate(road.plan_view, np.array([instance.road_object.s]))[2]
    across = np.concatenate([-np.sin(heading), np.cos(heading)])
    for number, area in enumerate(areas):
        colour = "" if bare else "white"
        patch = _patch(f"{name}_crosswalk_{number}", road, "crosswalk", colour)
        yield from painted(area if bare else zebra(area, across), patch)


def _area(ring: FloatArray) -> shapely.Geometry:
    return shapely.make_valid(shapely.Polygon(ring[:, :2]))


def _symbols(instance: Instance, areas: Sequence[shapely.Geometry]) -> list[shapely.Geometry]:
    """Returns the shape of a road mark: its outline, or the arrow of its name."""
    road_object = instance.road_object
    kind = next(filter(_is_arrow, (road_object.subtype, road_object.name)), None)
    if road_object.outlines or kind is None:
        return list(areas)
    shape = arrow(kind, road_object.length or 4.0, road_object.width or 0.6)
    return [shapely.transform(shape, lambda uv: _placed(instance, uv))]


def _is_arrow(name: str) -> bool:
    return any(word.startswith(_ARROWS) for word in words_of(name))


def _placed(instance: Instance, local: FloatArray) -> FloatArray:
    return instance.pose.places(np.column_stack([local, np.zeros(len(local))]))[:, :2]


def _marking_lines(
    instance: Instance, rings: Sequence[FloatArray], rules: MarkRules
) -> Iterator[tuple[shapely.Geometry, str]]:
    """Yields the lines of the object's markings (13.8) with their colours."""
    for record in instance.road_object.extra:
        if record.tag != "markings":
            continue
        for marking in record.children:
            path = _marking_path(instance.road_object, marking, rings)
            if path is None:
                continue
            start, stop = _number(marking, "startOffset"), _number(marking, "stopOffset")
            length = float(np.hypot(*np.diff(path, axis=0).T).sum())
            if length - start - stop <= 0.01:
                continue
            line = shapely.ops.substring(shapely.LineString(path), start, length - stop)
            usual = rules.line_width(marking.attributes.get("weight", ""))
            width = float(np.clip(_number(marking, "width") or usual, 0.03, 1.0))
            pattern = _number(marking, "lineLength"), _number(marking, "spaceLength")
            shape = dashes(shapely.get_coordinates(line), pattern, width)
            yield shape, marking.attributes.get("color", "standard")


def _marking_path(
    road_object: RoadObject, marking: Record, rings: Sequence[FloatArray]
) -> FloatArray | None:
    """Returns the path through the referenced corners, or along a side of the rectangle."""
    wanted = [
        child.attributes.get("id", "")
        for child in marking.children
        if child.tag == "cornerReference"
    ]
    if wanted and road_object.outlines:
        places = {
            corner: ring[k, :2]
            for outline, ring in zip(_outer(road_object), rings, strict=False)
            for k, corner in enumerate(outline.ids)
        }
        path = [places[corner] for corner in wanted if corner in places]
        return np.array(path) if len(path) > 1 else None
    side = _SIDES.get(marking.attributes.get("side", ""))
    if side is None or not rings or len(rings[0]) < 4:
        return None
    path_along: FloatArray = rings[0][list(side), :2]
    return path_along


def _outer(road_object: RoadObject) -> list[Outline]:
    return [
        outline for outline in road_object.outlines if outline.outer and len(outline.points) > 2
    ]


def _number(record: Record, name: str) -> float:
    return read(record.attributes.get(name, "0")) or 0.0


def _stop_line(road: Road, signal: Signal) -> Iterator[Strip]:
    """Yields a bar across all lanes that the signal applies to."""
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
    """Returns the lowest and highest t of the lanes that a signal applies to."""
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
    """Yields a parking bay as surface at the heights of its corners."""
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
