"""A strip of lanelets as a road of OpenDRIVE, without its links, objects and signals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lxml import etree

from envgen_usd.models.lanelet_map import FOOT, LaneletMap
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.lanelets.border_profiles import RoadShape
from envgen_usd.streets.lanelets.lane_groups import LANE_TYPES, LaneGroup
from envgen_usd.streets.lanelets.lanelet_marks import BorderMark, border_mark, kerb_height
from envgen_usd.streets.lanelets.road_strips import RoadStrip

_RAISED = 0.02
"""Least height of a sidewalk above the road that counts, metres."""
_HIGHEST = 0.3
"""Largest height of a sidewalk above the road, metres."""
_SPEEDS: Mapping[str, float] = {"play_street": 7.0, "highway": 130.0}
"""Speed of roads without a limit, km/h."""


@dataclass(frozen=True, eq=False)
class LaneletRoad:
    """A road on its way to the file.

    Attributes:
        id: Its id.
        strip: Its groups.
        shape: Its borders by s.
        ends: S at which each group ends.
        element: Its element.
    """

    id: str
    strip: RoadStrip
    shape: RoadShape
    ends: tuple[float, ...]
    element: etree._Element


def road_element(  # noqa: PLR0913, PLR0917 - what a road follows from
    number: str,
    junction: str,
    strip: RoadStrip,
    shape: RoadShape,
    ends: Sequence[float],
    source: LaneletMap,
    left_hand: bool,
) -> etree._Element:
    """The road with its plan view, profiles and lanes."""
    lanelets = [source.lanelets[n] for group in strip.groups for n in group.lanelets]
    kinds = {each.subtype for each in lanelets}
    limits = [each.speed for each in lanelets if each.speed and each.subtype not in FOOT]
    speed = max(limits, default=0.0) or max(
        (v for k, v in _SPEEDS.items() if k in kinds), default=50.0
    )
    element = elements.road(number, shape.curve.length, junction, round(speed))
    element.set("rule", "LHT" if left_hand else "RHT")
    names = [each.tags.get(key, "") for key in ("road_name", "name") for each in lanelets]
    first = next((name for name in names if name), "")
    element.set("name", first or f"lanelet {lanelets[0].id}")
    kind = element.find("type")
    assert kind is not None
    kind.set("type", _type(kinds, lanelets[0].tags.get("location", "")))
    elements.add_plan_view(element, shape.curve.pieces)
    elements.add_profile(element, "elevationProfile", "elevation", shape.elevation)
    if shape.superelevation:
        elements.add_profile(element, "lateralProfile", "superelevation", shape.superelevation)
    length = shape.curve.length
    divider = np.zeros(shape.t.shape[1])
    divider[strip.groups[0].divider] = 1.0
    elements.add_profile(element, "lanes", "laneOffset", shape.cubics(divider, 0.0, length))
    starts = (0.0, *ends[:-1])
    for group, start, end in zip(strip.groups, starts, ends, strict=True):
        _add_section(element, group, shape, (start, end), source, left_hand)
    return element


def _type(kinds: set[str], location: str) -> str:
    if "highway" in kinds:
        return "motorway"
    if "play_street" in kinds:
        return "lowSpeed"
    return "rural" if location == "nonurban" else "town"


def _add_section(  # noqa: PLR0913, PLR0917 - what lanes follow from
    road: etree._Element,
    group: LaneGroup,
    shape: RoadShape,
    part: tuple[float, float],
    source: LaneletMap,
    left_hand: bool,
) -> None:
    lines = [source.lines[side.line] for side in group.borders]
    marks = [
        border_mark(line, side.forward) for line, side in zip(lines, group.borders, strict=True)
    ]
    section = elements.add_lane_section(road, "none", part[0])
    centre = section.find("center/lane")
    assert centre is not None
    _set_mark(centre, marks[group.divider])
    lanes = [
        _lane(group, number, shape, part, source, marks, left_hand)
        for number in range(len(group.lanelets))
    ]
    if group.divider:
        left = etree.Element("left")
        left.extend(lanes[: group.divider])
        section.insert(0, left)
    if group.divider < len(lanes):
        etree.SubElement(section, "right").extend(lanes[group.divider :])


def _lane(  # noqa: PLR0913, PLR0917 - what a lane follows from
    group: LaneGroup,
    number: int,
    shape: RoadShape,
    part: tuple[float, float],
    source: LaneletMap,
    marks: Sequence[BorderMark],
    left_hand: bool,
) -> etree._Element:
    lanelet = source.lanelets[group.lanelets[number]]
    id_ = group.lane_id(number)
    weights = np.zeros(shape.t.shape[1])
    weights[number], weights[number + 1] = 1.0, -1.0
    widths = shape.cubics(weights, *part)
    kind = LANE_TYPES[lanelet.subtype]
    side = etree.Element("side")
    lane = elements.add_lane(side, id_, "driving", widths, "none")
    lane.set("type", kind)
    _set_mark(lane, marks[number if id_ > 0 else number + 1].outwards(id_))
    if lanelet.speed:
        limit = {"sOffset": "0", "max": elements.text(lanelet.speed), "unit": "km/h"}
        etree.SubElement(lane, "speed", limit)
    if kind == "sidewalk":
        inner, outer = (number + 1, number) if id_ > 0 else (number, number + 1)
        height = _raised(group, inner, outer, shape, source)
        if height:
            value = elements.text(height)
            etree.SubElement(lane, "height", sOffset="0", inner=value, outer=value)
    elif not lanelet.one_way:
        lane.set("direction", "both")
    elif group.along[number] != (id_ < 0) ^ left_hand:
        lane.set("direction", "reversed")
    return lane


def _raised(
    group: LaneGroup, inner: int, outer: int, shape: RoadShape, source: LaneletMap
) -> float:
    """Height of a sidewalk above the lanes for vehicles: the map's, or that of its kerb."""
    if all(source.lanelets[n].subtype in FOOT for n in group.lanelets):
        return 0.0
    measured = float(shape.above[outer])
    if _RAISED < measured < _HIGHEST:
        return round(measured, 3)
    side = group.borders[inner]
    return kerb_height(source.lines[side.line])


def _set_mark(lane: etree._Element, mark: BorderMark) -> None:
    element = lane.find("roadMark")
    assert element is not None
    if mark.kind == "none":
        lane.remove(element)
        element = etree.SubElement(lane, "roadMark", sOffset="0", type="none")
        return
    element.set("type", mark.kind)
    element.set("weight", "bold" if mark.bold else "standard")
    element.set("color", mark.colour)
    element.set("width", elements.text(mark.width))
    if mark.change:
        element.set("laneChange", mark.change)
