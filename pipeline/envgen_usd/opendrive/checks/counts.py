"""Dashes and instances that a few figures stand for: hostile ones stand for a billion."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RoadMark
from envgen_usd.models.road_objects import Repeat, RoadObject
from envgen_usd.opendrive.checks.index import Index
from envgen_usd.opendrive.elements.objects import OBJECT_TAGS
from envgen_usd.opendrive.features.kinds import FLAT, kind_of
from envgen_usd.opendrive.findings import Element, Findings, remove

MOST_DASHES = 20_000
"""Dashes that one mark of one lane section may take."""
LARGEST = 200.0
"""Metres that paint, a bay or an island on a road reaches."""
CLOSEST = 1.0
"""Metres between repeated ones of these."""
MOST_INSTANCES = 50_000
"""Instances that all repeats of a file may take together."""


def mend_counts(roads: dict[str, Road], index: Index, findings: Findings) -> dict[str, Road]:
    """Takes marks of too many dashes as solid, and leaves out repeats beyond `MOST_INSTANCES`.

    Args:
        roads: By id.
        index: Elements; mended.
        findings: Takes the issues.
    """
    mended = dict(roads)
    left = float(MOST_INSTANCES)
    vast: dict[str, list[int]] = {}
    for id_, road in roads.items():
        if any(_is_dense(mark, section) for section, mark in _marks(road)):
            text = f"a road mark of more than {MOST_DASHES} dashes"
            findings.mended("road_mark.dense", index.roads[id_], text, "taken as one line")
            mended[id_] = _solid(road)
        for place, thing in enumerate(road.objects):
            if _is_vast(thing):
                vast.setdefault(id_, []).append(place)
            elif thing.repeats:
                left -= sum(map(instances_of, thing.repeats))
                if left < 0:
                    left += sum(map(instances_of, thing.repeats))
                    element = _object(index.roads[id_], place)
                    mended[id_] = _without_repeats(mended[id_], place, element, findings)
    for id_, places in vast.items():
        mended[id_] = _without_objects(mended[id_], places, index.roads[id_], findings)
    return mended


def instances_of(repeat: Repeat) -> float:
    """Number of instances that a repeat stands for; none if it is continuous."""
    return repeat.length / repeat.distance + 1 if repeat.distance > 0 else 0.0


def _is_vast(thing: RoadObject) -> bool:
    """Whether what lies on the road is larger, or repeated closer, than any of its kind."""
    if kind_of(thing).template != FLAT or thing.type in {"tunnel", "bridge"}:
        return False
    sizes = [thing.length, thing.width, thing.radius]
    for outline in thing.outlines:
        at = (thing.s, thing.t) if outline.in_road else (0.0, 0.0)
        sizes.append(float(np.abs(outline.points[:, :2] - at).max()))
    close = any(0 < repeat.distance < min(CLOSEST, repeat.length) for repeat in thing.repeats)
    return close or max(sizes) > LARGEST


def _without_objects(road: Road, places: list[int], element: Element, findings: Findings) -> Road:
    elements = [_object(element, place) for place in places]
    for each in elements:
        text = f"lies on the road over more than {LARGEST:g} m, or every {CLOSEST:g} m"
        findings.mended("object.endless", each, text, "object left out", Severity.ERROR)
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
    things = (each for group in road.iterchildren("objects") for each in group)
    return [each for each in things if each.tag in OBJECT_TAGS][place]


def _without_repeats(road: Road, place: int, element: Element, findings: Findings) -> Road:
    thing: RoadObject = road.objects[place]
    text = f"repeats of this file stand for more than {MOST_INSTANCES} instances"
    findings.mended("repeat.endless", element, text, "one instance", Severity.ERROR)
    for repeat in list(element.iterchildren("repeat")):
        remove(repeat)
    objects = [*road.objects]
    objects[place] = replace(thing, repeats=())
    return replace(road, objects=tuple(objects))
