"""The mirror image of an OpenDRIVE document: east and west swapped, traffic on the other side."""

import math
from collections.abc import Mapping

import numpy as np
from lxml import etree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.xml_events import local_name

_NEGATED: Mapping[str, tuple[str, ...]] = {
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": tuple("abcd"),
    "paramPoly3": ("aV", "bV", "cV", "dV"),
    "laneOffset": tuple("abcd"),
    "object": ("t", "hdg"),
    "signal": ("t",),
    "cornerLocal": ("v",),
    "cornerRoad": ("t",),
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
_RULES: Mapping[str, str] = {"LHT": "RHT", "RHT": "LHT"}


def mirrored_points(points: FloatArray) -> FloatArray:
    """Points with east and west swapped; ... x 2 or 3."""
    turned = np.array(points, float)
    turned[..., 0] *= -1.0
    return turned


def mirror_document(root: etree._Element) -> None:
    """Swaps east and west of a document, in place.

    All that measures to the left of the reference line changes its sign, lanes change their side
    and sign, arrows point the other way, and traffic keeps to the other side. Heights and
    distances along roads stay. Superelevation and cross-sections stay, too: the roads of maps have
    none, and programs that ask for an image do not need them.
    """
    for element in root.iter("{*}*"):
        name = local_name(element)
        for attribute in _NEGATED.get(name, ()):
            _negate(element, attribute)
        if name == "geometry":
            _negate(element, "x")
            heading = math.pi - float(element.get("hdg", "0"))
            element.set("hdg", _text(math.remainder(heading, 2.0 * math.pi)))
        elif name == "road":
            element.set("rule", _RULES[element.get("rule", "RHT")])
        elif name == "laneSection":
            _mirror_section(element)
        elif name == "laneLink":
            element.set("from", _number(element, "from"))
            element.set("to", _number(element, "to"))
        elif name == "object":
            element.set("name", _ARROWS.get(element.get("name", ""), element.get("name", "")))


def _text(value: float) -> str:
    return f"{value:.12g}"


def _negate(element: etree._Element, name: str) -> None:
    value = float(element.get(name, "0"))
    element.set(name, _text(-value if value else 0.0))


def _number(element: etree._Element, name: str) -> str:
    return str(-int(element.get(name, "0")))


def _mirror_section(section: etree._Element) -> None:
    """Lanes of the left to the right and the other way round, in the order of the standard."""
    sides = {local_name(side): side for side in section.iterchildren("{*}*")}
    for name, side in sides.items():
        for lane in side.iterchildren("{*}lane"):
            lane.set("id", _number(lane, "id"))
            for link in lane.iterfind("{*}link/{*}*"):
                link.set("id", _number(link, "id"))
            for mark in lane.iter("{*}roadMark"):
                change = mark.get("laneChange")
                if change is not None:
                    mark.set("laneChange", _CHANGES.get(change, change))
                if name == "center":
                    mark.set("type", " ".join(mark.get("type", "none").split()[::-1]))
        for lane in list(side):
            side.insert(0, lane)
        side.tag = side.tag.replace(name, _OTHER.get(name, name))
    for name in ("right", "center", "left"):
        if name in sides:
            section.append(sides[name])
