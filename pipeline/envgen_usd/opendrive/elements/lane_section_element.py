"""Reads lane sections and lane offsets of a road, by lane layer (11.2 to 11.4)."""

from itertools import pairwise

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.lanes import Lane, LaneLayer, LaneSection
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import needed, number, write
from envgen_usd.opendrive.elements.cubic_elements import NAMES, read_cubics, sort_siblings
from envgen_usd.opendrive.elements.empty_sections import leave_out
from envgen_usd.opendrive.elements.lane_element import lane_id, read_lane
from envgen_usd.opendrive.elements.single_side_sections import fill_single_sides

PERMANENT = "permanent"
"""Layer of lanes elements without a layer name."""
SHORTEST = 1e-6
"""Shortest lane section in metres; shorter sections have no area and are left out."""


def read_lane_layers(
    road: Element, length: float, findings: Findings
) -> tuple[LaneLayer, tuple[LaneLayer, ...]]:
    """Reads the lanes elements of a road.

    Args:
        road: The road; repaired in place.
        length: Length of the road in metres.
        findings: Collects the issues.

    Returns:
        The permanent layer, which covers the whole road, and the other layers.
    """
    groups = list(road.iterchildren("lanes"))
    permanent = next((each for each in groups if each.get("layer", PERMANENT) == PERMANENT), None)
    if permanent is None and groups:
        permanent = groups[0]
        text = f"the road has only {permanent.get('layer')} lanes"
        findings.repaired("lanes.no_permanent_layer", permanent, text, "treated as permanent")
        permanent.set("layer", PERMANENT)
    if permanent is None:
        findings.repaired(
            "road.no_lanes", road, "the road has no lanes", "treated as a road without area"
        )
        permanent = road.makeelement("lanes")
        road.append(permanent)
    others = tuple(_layer(each, length, findings) for each in groups if each is not permanent)
    return _permanent(permanent, length, findings), others


def _layer(lanes: Element, length: float, findings: Findings) -> LaneLayer:
    name = lanes.get("layer", PERMANENT)
    elements = list(lanes.iterchildren("laneSection"))
    starts = [needed(element, "s", findings) for element in elements]
    ends = []
    for element, start, following in zip(elements, starts, [*starts[1:], length], strict=False):
        extent = number(element, "length", findings, length)
        ends.append(min(start + extent, following if following > start else length, length))
    sections = tuple(
        _section(element, s, end, name, findings)
        for element, s, end in zip(elements, starts, ends, strict=True)
    )
    return LaneLayer(name, _offset(lanes, findings), sections)


def _permanent(lanes: Element, length: float, findings: Findings) -> LaneLayer:
    elements = _ordered(lanes, length, findings)
    starts = [float(element.get("s", "0")) for element in elements]
    sections = [
        _section(element, s, end, PERMANENT, findings)
        for element, (s, end) in zip(elements, pairwise([*starts, length]), strict=True)
    ]
    sides = [element.get("singleSide") in {"true", "1"} for element in elements]
    if any(sides):
        sections = fill_single_sides(sections, sides)
    offset = _offset(lanes, findings)
    if any(_has_borders(section) for section in sections) and offset.coefficients.any():
        offset = _drop_offset(lanes, findings)
    return LaneLayer(PERMANENT, offset, tuple(sections))


def _offset(lanes: Element, findings: Findings) -> Cubics:
    """Reads the lane offset (11.4), which is 0 before its first element."""
    offset = read_cubics(list(lanes.iterchildren("laneOffset")), "s", findings)
    if not len(offset.start) or offset.start[0] < SHORTEST:
        return offset
    zero = lanes.makeelement("laneOffset", dict.fromkeys(("s", *NAMES), "0"))
    lanes.insert(lanes.index(next(lanes.iterchildren("laneOffset"))), zero)
    return Cubics(np.append(0.0, offset.start), np.vstack([np.zeros(4), offset.coefficients]))


def _drop_offset(lanes: Element, findings: Findings) -> Cubics:
    text = "lanes with borders have a laneOffset"
    findings.repaired("lanes.offset_and_border", lanes, text, "laneOffset left out")
    for element in list(lanes.iterchildren("laneOffset")):
        remove(element)
    return NO_CUBICS


def _has_borders(section: LaneSection) -> bool:
    return any(len(lane.border.start) for lane in (*section.left, *section.right))


def _ordered(lanes: Element, length: float, findings: Findings) -> list[Element]:
    """Returns the non-empty sections in order of s; the first starts at 0."""
    elements = list(lanes.iterchildren("laneSection"))
    if not elements:
        findings.repaired(
            "road.no_lanes", lanes, "no laneSection", "treated as a road without area"
        )
        elements = [lanes.makeelement("laneSection", {"s": "0.0"})]
        lanes.append(elements[0])
    starts = [needed(element, "s", findings) for element in elements]
    if any(start > following for start, following in pairwise(starts)):
        order = sort_siblings(elements, np.array(starts), "s", findings)
        elements, starts = [elements[k] for k in order], [starts[k] for k in order]
    starts = [max(start, 0.0) for start in starts]
    ends = [*starts[1:], length]
    empty = [min(end, length) - start < SHORTEST for start, end in zip(starts, ends, strict=True)]
    if all(empty):
        empty[0] = False
    kept: list[Element] = []
    for place, (element, drop) in enumerate(zip(elements, empty, strict=True)):
        if drop:
            text = f"the lane section at s={starts[place]:g} has no length"
            findings.repaired("lane_section.empty", element, text, "left out", Severity.INFO)
            after = elements[place + 1] if place + 1 < len(elements) else None
            leave_out(element, kept[-1] if kept else None, after)
        else:
            kept.append(element)
    if float(kept[0].get("s", "0")) != 0:
        text = f"the first lane section starts at s={kept[0].get('s')}"
        findings.repaired("lane_section.start", kept[0], text, "moved to 0", Severity.INFO)
        kept[0].set("s", write(0.0))
    return kept


def _section(element: Element, s: float, end: float, layer: str, findings: Findings) -> LaneSection:
    lanes: dict[int, Lane] = {}
    for side in element.iterchildren("left", "center", "right"):
        for each in list(side.iterchildren("lane")):
            id_ = lane_id(each.get("id", ""))
            if id_ is None or id_ in lanes:
                text = f"id={each.get('id')!r} is {'not a lane id' if id_ is None else 'taken'}"
                findings.repaired("lane.id", each, text, "lane left out", Severity.ERROR)
                remove(each)
            else:
                lanes[id_] = read_lane(each, id_, layer, findings)
    centre = lanes.get(0)
    if centre is None:
        findings.repaired(
            "lane_section.no_centre", element, "lane 0 is missing", "added", Severity.INFO
        )
        centre = Lane(0, "none")
        _add_centre(element)
    left = tuple(lanes[id_] for id_ in sorted(id_ for id_ in lanes if id_ > 0))
    right = tuple(lanes[id_] for id_ in sorted((id_ for id_ in lanes if id_ < 0), reverse=True))
    for side_lanes in (left, right):
        if side_lanes and abs(side_lanes[-1].id) != len(side_lanes):
            ids = ", ".join(str(lane.id) for lane in side_lanes)
            findings.noted("lane_section.ids", element, f"lane ids {ids} are not consecutive")
    return LaneSection(s, end, left, centre, right)


def _add_centre(section: Element) -> None:
    centre = section.find("center")
    if centre is None:
        centre = section.makeelement("center")
        left = section.find("left")
        section.insert(0 if left is None else section.index(left) + 1, centre)
    centre.append(centre.makeelement("lane", {"id": "0", "type": "none", "level": "false"}))
