"""Bounds on dashes and instances; a few hostile numbers would request a billion of them."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RoadMark
from envgen_usd.models.road_objects import Repeat, RoadObject
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.elements.object_element import OBJECT_TAGS
from envgen_usd.opendrive.features.object_kinds import FLAT, element_length, kind_of

MOST_DASHES = 20_000
"""Largest number of dashes in a mark of a lane section; denser marks become solid."""
LARGEST = 200.0
"""Largest extent in metres of paint, a parking bay or an island."""
LONGEST_ELEMENT = 1_000.0
"""Largest length in metres of a barrier without an extruded repeat."""
CLOSEST = 1.0
"""Least spacing in metres of repeated paint, parking bays or islands."""
MOST_INSTANCES = 50_000
"""Largest number of instances from all repeats of a file."""


def repair_counts(roads: dict[str, Road], index: Index, findings: Findings) -> dict[str, Road]:
    """Turns marks with too many dashes into solid marks, and drops repeats beyond the bounds.

    Args:
        roads: Roads by id.
        index: XML elements; repaired in place.
        findings: Collects the issues.
    """
    repaired = dict(roads)
    left = float(MOST_INSTANCES)
    vast: dict[str, list[int]] = {}
    for id_, road in roads.items():
        if any(mark.lines and _is_dense(mark, section) for section, mark in _marks(road)):
            text = f"a road mark has more than {MOST_DASHES} dashes"
            findings.repaired("road_mark.dense", index.roads[id_], text, "treated as a solid line")
            repaired[id_] = _solid(road)
        for place, road_object in enumerate(road.objects):
            if _is_vast(road_object):
                vast.setdefault(id_, []).append(place)
            elif road_object.repeats:
                left -= _cost(road_object)
                if left < 0:
                    left += _cost(road_object)
                    element = _object(index.roads[id_], place)
                    repaired[id_] = _without_repeats(repaired[id_], place, element, findings)
    for id_, places in vast.items():
        repaired[id_] = _without_objects(repaired[id_], places, index.roads[id_], findings)
    return repaired


def instances_of(repeat: Repeat) -> float:
    """Returns the number of instances of a repeat; 0 for a continuous repeat."""
    return repeat.length / repeat.distance + 1 if repeat.distance > 0 else 0.0


def _cost(road_object: RoadObject) -> float:
    """Returns the number of instances, with the posts of each barrier element."""
    posts = _extent(road_object) / CLOSEST if kind_of(road_object).section else 0.0
    return sum(map(instances_of, road_object.repeats)) * (1.0 + posts)


def _extent(road_object: RoadObject) -> float:
    """Returns the largest length of an object or of its instances, metres."""
    repeated = [value for repeat in road_object.repeats for value in repeat.extent]
    return _largest([element_length(road_object), *repeated])


def _largest(sizes: Iterable[float]) -> float:
    """Returns the largest size that is a number; 0 without any."""
    return max((size for size in sizes if not math.isnan(size)), default=0.0)


def _is_vast(road_object: RoadObject) -> bool:
    """Returns whether a flat object exceeds `LARGEST`, or a barrier element `LONGEST_ELEMENT`.

    Flat objects that repeat closer than `CLOSEST` are vast, too.
    """
    kind = kind_of(road_object)
    if kind.section:
        extruded = any(repeat.distance == 0 for repeat in road_object.repeats)
        return not extruded and _extent(road_object) > LONGEST_ELEMENT
    if kind.template != FLAT or road_object.type in {"tunnel", "bridge"}:
        return False
    swept = [width for each in road_object.repeats if each.distance == 0 for width in each.width]
    if _largest(swept) > LARGEST:
        return True
    sizes = [road_object.length, road_object.width, road_object.radius]
    for outline in road_object.outlines:
        at = (road_object.s, road_object.t) if outline.in_road else (0.0, 0.0)
        sizes.append(float(np.abs(outline.points[:, :2] - at).max()))
    close = any(0 < repeat.distance < min(CLOSEST, repeat.length) for repeat in road_object.repeats)
    return close or max(sizes) > LARGEST


def _without_objects(road: Road, places: list[int], element: Element, findings: Findings) -> Road:
    elements = [_object(element, place) for place in places]
    for place, each in zip(places, elements, strict=True):
        bound = LONGEST_ELEMENT if kind_of(road.objects[place]).section else LARGEST
        text = f"the object exceeds {bound:g} m, or repeats within {CLOSEST:g} m"
        findings.repaired("object.endless", each, text, "object left out", Severity.ERROR)
        remove(each)
    kept = (each for place, each in enumerate(road.objects) if place not in places)
    return replace(road, objects=tuple(kept))


def _marks(road: Road) -> Iterator[tuple[LaneSection, RoadMark]]:
    layers = (road.sections, *(layer.sections for layer in road.layers))
    for section in (each for sections in layers for each in sections):
        for lane in (*section.left, section.centre, *section.right):
            for mark in lane.marks:
                yield section, mark


def _is_dense(mark: RoadMark, section: LaneSection) -> bool:
    periods = [line.length + line.space for line in mark.lines if line.space > 0]
    return bool(periods) and section.end - section.s > MOST_DASHES * min(periods)


def _solid(road: Road) -> Road:
    def mark_of(mark: RoadMark, section: LaneSection) -> RoadMark:
        if not _is_dense(mark, section):
            return mark
        return replace(mark, lines=tuple(replace(line, space=0.0) for line in mark.lines))

    def lane_of(lane: Lane, section: LaneSection) -> Lane:
        return replace(lane, marks=tuple(mark_of(mark, section) for mark in lane.marks))

    def sections_of(sections: tuple[LaneSection, ...]) -> tuple[LaneSection, ...]:
        return tuple(
            replace(
                section,
                left=tuple(lane_of(lane, section) for lane in section.left),
                centre=lane_of(section.centre, section),
                right=tuple(lane_of(lane, section) for lane in section.right),
            )
            for section in sections
        )

    layers = tuple(replace(layer, sections=sections_of(layer.sections)) for layer in road.layers)
    return replace(road, sections=sections_of(road.sections), layers=layers)


def _object(road: Element, place: int) -> Element:
    elements = (each for group in road.iterchildren("objects") for each in group)
    return [each for each in elements if each.tag in OBJECT_TAGS][place]


def _without_repeats(road: Road, place: int, element: Element, findings: Findings) -> Road:
    road_object: RoadObject = road.objects[place]
    text = f"the repeats of this file have more than {MOST_INSTANCES} instances"
    findings.repaired("repeat.endless", element, text, "reduced to one instance", Severity.ERROR)
    for repeat in list(element.iterchildren("repeat")):
        remove(repeat)
    objects = [*road.objects]
    objects[place] = replace(road_object, repeats=())
    return replace(road, objects=tuple(objects))
