"""The mirror image of a road file: traffic on the left instead of the right."""

import math
from collections.abc import Mapping
from dataclasses import replace

from lxml import etree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.streets.mapped_roads import MappedRoads
from envgen_usd.streets.road_elements import text

_NEGATED: Mapping[str, tuple[str, ...]] = {
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "paramPoly3": ("aV", "bV", "cV", "dV"),
    "laneOffset": tuple("abcd"),
    "object": ("t", "hdg"),
    "signal": ("t",),
    "cornerLocal": ("v",),
}
"""Attributes that measure to the left."""
_OTHER = {"left": "right", "right": "left"}
_ARROWS: Mapping[str, str] = {
    "arrowLeft": "arrowRight",
    "arrowRight": "arrowLeft",
    "arrowStraightLeft": "arrowStraightRight",
    "arrowStraightRight": "arrowStraightLeft",
}
_CHANGES: Mapping[str, str] = {"increase": "decrease", "decrease": "increase"}


def mirrored_roads(roads: MappedRoads) -> MappedRoads:
    """Roads with east and west swapped, as `mapped_roads` writes them, for traffic on the left.

    All that measures to the left of the reference line changes its sign, lanes change their side
    and sign, and arrows point the other way. Heights and distances along roads stay.
    """
    root = etree.fromstring(roads.xml)
    for element in root.iter():
        for name in _NEGATED.get(element.tag, ()):
            _negate(element, name)
    for geometry in root.iter("geometry"):
        _negate(geometry, "x")
        heading = math.pi - float(geometry.get("hdg", "0"))
        geometry.set("hdg", text(math.remainder(heading, 2.0 * math.pi)))
    for road in root.iter("road"):
        road.set("rule", "LHT")
    for section in root.iter("laneSection"):
        _mirror_section(section)
    for link in root.iter("laneLink"):
        link.set("from", _number(link, "from"))
        link.set("to", _number(link, "to"))
    for each in root.iter("object"):
        each.set("name", _ARROWS.get(each.get("name", ""), each.get("name", "")))
    xml = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    land = tuple(replace(point, place=_swapped(point.place)) for point in roads.land)
    return replace(roads, xml=xml, land=land)


def _negate(element: etree._Element, name: str) -> None:
    value = float(element.get(name, "0"))
    element.set(name, text(-value if value else 0.0))


def _number(element: etree._Element, name: str) -> str:
    return str(-int(element.get(name, "0")))


def _mirror_section(section: etree._Element) -> None:
    """Lanes of the left to the right and the other way round, in the order of the standard."""
    sides = {side.tag: side for side in section}
    for name, side in sides.items():
        for lane in side.iter("lane"):
            lane.set("id", _number(lane, "id"))
            for link in lane.iterfind("link/*"):
                link.set("id", _number(link, "id"))
            for mark in lane.iter("roadMark"):
                change = mark.get("laneChange")
                if change is not None:
                    mark.set("laneChange", _CHANGES.get(change, change))
                if name == "center":
                    mark.set("type", " ".join(mark.get("type", "none").split()[::-1]))
        for lane in list(side):
            side.insert(0, lane)
        side.tag = _OTHER.get(name, name)
    section.extend([sides[name] for name in ("right", "center", "left") if name in sides])


def _swapped(place: FloatArray) -> FloatArray:
    turned: FloatArray = place * [-1.0, 1.0]
    return turned
