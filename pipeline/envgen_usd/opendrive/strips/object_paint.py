"""Paint and repaired places of the road from objects (1.8.1, 13.1, 13.8 and 13.9)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
import shapely.ops

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.kept_records import Record
from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.models.road_objects import Origin, Outline, RoadObject
from envgen_usd.models.road_surface import Patch
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.features.lying_instances import lying_instances
from envgen_usd.opendrive.features.name_words import Vocabulary, words_of
from envgen_usd.opendrive.features.object_instances import Instance
from envgen_usd.opendrive.features.object_kinds import FLAT, kind_of
from envgen_usd.opendrive.features.object_outlines import corners, outer_rings
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.paint_shapes import arrow, dashes, hatched, painted, zebra
from envgen_usd.opendrive.surface_ids import origin_id

STOP_LINE = 0.4
"""Width of a stop line in metres along the road."""
STOP_LINES = Vocabulary([(True, ("stop line", "holding line", "halt linie"))])
"""Names of stop lines."""
_LINES = Vocabulary(
    [("dashed", ("broken", "dashed")), ("solid", ("solid",)), ("hatched", ("chevron", "hatch"))]
)
"""Patterns by the names of painted lines and areas."""
_ARROWS = ("arrow", "leftarrow", "rightarrow", "straightarrow")
"""Begins of words for arrows; ``narrow`` is no arrow."""
_DIRECTIONS = ("left", "right", "straight")
_YELLOW = ("yellow", "orange")
_PAINTED = frozenset(("crosswalk", "road_mark", "road_surface"))
_SIDES: Mapping[str, tuple[int, int]] = {
    "left": (1, 2),
    "right": (3, 0),
    "front": (0, 1),
    "rear": (2, 3),
}
"""Corner indices of an object's rectangle at the ends of each side."""


def paint_strips(road: Road, rules: MarkRules = RMS_MARKS) -> Iterator[tuple[float, Strip]]:
    """Yields crosswalks, road marks, object markings and road surfaces as triangles.

    They apply to all lanes.

    Args:
        road: The road.
        rules: Sizes of lines of objects where the file leaves them open.

    Yields:
        s of the object, and a triangle.
    """
    for number, road_object in enumerate(road.objects):
        origin = Origin(road.id, "object", number, road_object.id)
        for place, instance in enumerate(_flat(road, road_object)):
            paint = _Paint(road, instance, origin, f"{origin_id(origin)}_{place}", rules)
            for strip in paint.strips():
                yield instance.road_object.s, strip


def _flat(road: Road, road_object: RoadObject) -> Iterator[Instance]:
    kind = kind_of(road_object)
    marked = any(record.tag == "markings" for record in road_object.extra)
    if (kind.template == FLAT and kind.name in _PAINTED) or marked:
        yield from lying_instances(road, road_object)


@dataclass(frozen=True)
class _Paint:
    """What an instance of an object paints.

    Attributes:
        road: The object's road.
        instance: The object with its pose.
        origin: The object in the file.
        name: Begin of the ids of its patches.
        rules: Sizes of lines where the file leaves them open.
    """

    road: Road
    instance: Instance
    origin: Origin
    name: str
    rules: MarkRules

    def strips(self) -> Iterator[Strip]:
        """Yields the triangles of the paint; later paint covers earlier paint."""
        road_object = self.instance.road_object
        rings = outer_rings(self.road, self.instance)
        areas = [_area(ring) for ring in rings]
        lines = list(_marking_lines(self.instance, rings, self.rules))
        kind = kind_of(road_object)
        shown = kind.name if kind.template == FLAT else ""
        if shown == "road_surface":
            for number, area in enumerate(areas):
                yield from painted(area, self._road_surface(number))
        if shown == "crosswalk":
            yield from self._crosswalk(areas, bare=bool(lines))
        for number, (shape, colour) in enumerate(lines):
            yield from painted(shape, self._patch(f"line_{number}", "mark", colour))
        if shown == "road_mark" and not lines:
            for number, shape in enumerate(self._symbols(areas)):
                yield from painted(shape, self._patch(f"{number}", "mark", _colour(road_object)))

    def _crosswalk(self, areas: Sequence[shapely.Geometry], *, bare: bool) -> Iterator[Strip]:
        """Yields the stripes of a crosswalk, or the bare road between the lines of the file."""
        s = np.array([self.instance.road_object.s])
        heading = evaluate(self.road.plan_view, s)[2]
        across = np.concatenate([-np.sin(heading), np.cos(heading)])
        for number, area in enumerate(areas):
            patch = self._patch(f"crosswalk_{number}", "crosswalk", "" if bare else "white")
            yield from painted(area if bare else zebra(area, across), patch)

    def _symbols(self, areas: Sequence[shapely.Geometry]) -> list[shapely.Geometry]:
        """Returns the shape of a road mark: its lines, its outline, or the arrow of its name.

        A model's name without an outline and a direction tells no shape.
        """
        road_object = self.instance.road_object
        pattern = _LINES.meaning(road_object.name) or ""
        if road_object.outlines and _is_line(road_object, pattern):
            return list(self._lines(pattern))
        if pattern == "hatched":
            along = self.instance.pose.heading
            return [hatched(area, along) for area in areas if road_object.outlines]
        typed = road_object.type.lower() == "roadmark"
        names = road_object.subtype, road_object.name
        kind = next((name for name in names if is_arrow(name, straight=typed)), None)
        if road_object.outlines or (typed and kind is None):
            return list(areas)
        if kind is None:
            return []
        shape = arrow(kind, road_object.length or 4.0, road_object.width or 0.6)
        return [shapely.transform(shape, self._placed)]

    def _lines(self, pattern: str) -> Iterator[shapely.Geometry]:
        """Yields the painted lines along the outlines."""
        stop = STOP_LINES.meaning(self.instance.road_object.name)
        width = STOP_LINE if stop else self.rules.line_width("")
        dash = (self.rules.dash_length, self.rules.dash_gap) if pattern == "dashed" else (0.0, 0.0)
        for outline in self.instance.road_object.outlines:
            path = corners(self.road, self.instance, outline)[:, :2]
            if len(path) > 1 and np.ptp(path, axis=0).any():
                yield dashes(path, dash, width)

    def _placed(self, local: FloatArray) -> FloatArray:
        return self.instance.pose.places(np.column_stack([local, np.zeros(len(local))]))[:, :2]

    def _patch(self, part: str, kind: str, colour: str) -> Patch:
        return Patch(
            id=f"{self.name}_{part}",
            kind=kind,
            lane_type="driving",
            road=self.road.id,
            junction=self.road.junction,
            colour=colour,
            mark_type="solid" if kind == "mark" else "",
            origin=self.origin,
        )

    def _road_surface(self, number: int) -> Patch:
        records = self.instance.road_object.extra
        named = (each.attributes.get("surface", "") for each in records if each.tag == "material")
        patch = self._patch(f"surface_{number}", "road_surface", "")
        return replace(patch, material=next(filter(None, named), ""))


def _area(ring: FloatArray) -> shapely.Geometry:
    return shapely.make_valid(shapely.Polygon(ring[:, :2]))


def _is_line(road_object: RoadObject, pattern: str) -> bool:
    """Returns whether the outlines of a road mark are lines, not borders of painted areas."""
    if pattern in {"solid", "dashed"} or STOP_LINES.meaning(road_object.name):
        return road_object.type.lower() != "roadmark" or not _closed(road_object)
    return not _closed(road_object)


def _closed(road_object: RoadObject) -> bool:
    return all(each.closed and len(each.points) > 2 for each in road_object.outlines)


def is_arrow(name: str, *, straight: bool = True) -> bool:
    """Returns whether a name is that of an arrow.

    Args:
        name: Name of an object or a signal.
        straight: Whether an arrow without a direction is one straight ahead.
    """
    words = words_of(name)
    named = any(word.startswith(_ARROWS) for word in words)
    return named and (straight or any(way in word for word in words for way in _DIRECTIONS))


def _colour(road_object: RoadObject) -> str:
    words = words_of(road_object.name)
    return "yellow" if any(word in _YELLOW for word in words) else "white"


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
