"""Reads roads (chapter 8)."""

import math

from envgen_usd.errors import Severity
from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.road import Road, RoadLink, RoadType
from envgen_usd.opendrive.document.findings import (
    Element,
    Findings,
    Hostile,
    Unusable,
    line_of,
    remove,
)
from envgen_usd.opendrive.document.number_attributes import needed, number, write
from envgen_usd.opendrive.elements.kept_elements import leftovers, others
from envgen_usd.opendrive.elements.lane_section_element import read_lane_layers
from envgen_usd.opendrive.elements.object_element import read_objects
from envgen_usd.opendrive.elements.plan_view_element import read_plan_view
from envgen_usd.opendrive.elements.profile_elements import (
    read_cross_section,
    read_profile,
    read_shapes,
)
from envgen_usd.opendrive.elements.signal_element import read_signals
from envgen_usd.opendrive.elements.speed_units import speed

LENGTH_TOLERANCE = 0.01
"""Tolerated difference in metres of the road's length from the sum of its geometries."""
LONGEST = 1e6
"""Largest length of a road in metres; longer roads are refused."""
_ATTRIBUTES = frozenset({"id", "name", "length", "junction", "rule"})
_KNOWN = frozenset(
    {
        "link",
        "type",
        "planView",
        "elevationProfile",
        "lateralProfile",
        "lanes",
        "objects",
        "signals",
    }
)


def read_road(element: Element, findings: Findings) -> Road:
    """Reads a road.

    Args:
        element: The road with a unique id; repaired in place.
        findings: Collects the issues.

    Raises:
        Unusable: The road has no usable position.
        Hostile: The road exceeds `LONGEST`.
    """
    plan_element = _only(element, "planView", findings)
    if plan_element is None:
        raise Unusable(element, "road.no_plan_view", "planView is missing")
    plan_view = read_plan_view(plan_element, findings)
    length = _length(element, plan_view, findings)
    layer, layers = read_lane_layers(element, length, findings)
    elevation, lateral, link = (
        _only(element, tag, findings) for tag in ("elevationProfile", "lateralProfile", "link")
    )
    junction = element.get("junction", "-1")
    return Road(
        element.get("id", ""),
        element.get("name", ""),
        length,
        "" if junction == "-1" else junction,
        _rule(element, findings),
        _link(link, "predecessor", findings),
        _link(link, "successor", findings),
        tuple(_type(each, findings) for each in element.iterchildren("type")),
        plan_view,
        read_profile(elevation, "elevation", findings),
        read_profile(lateral, "superelevation", findings),
        read_shapes(lateral, findings),
        read_cross_section(lateral, findings),
        *(layer.lane_offset, layer.sections),
        *(read_objects(element, findings), read_signals(element, findings)),
        (*leftovers(element, _ATTRIBUTES), *others(element, _KNOWN)),
        *(line_of(element), layers),
    )


def _only(element: Element, tag: str, findings: Findings) -> Element | None:
    """Returns the only child with a tag; removes further children with that tag."""
    children = list(element.iterchildren(tag))
    for again in children[1:]:
        findings.repaired("element.repeated", again, f"a second {tag}", "left out")
        remove(again)
    return children[0] if children else None


def _length(element: Element, plan_view: PlanView, findings: Findings) -> float:
    """Returns the length of the reference line; repairs a different attribute."""
    length = float(plan_view.s[-1] + plan_view.length[-1])
    if not max(length, plan_view.length.max()) <= LONGEST:
        raise Hostile(element, f"the road is {length:g} m long")
    declared = needed(element, "length", findings, length)
    if abs(declared - length) > LENGTH_TOLERANCE:
        text = f"length {declared:g} m, but its geometries are {length:g} m long"
        findings.repaired("road.length", element, text, f"set to {length:g} m")
        element.set("length", write(length))
    return length


def _rule(element: Element, findings: Findings) -> str:
    rule = element.get("rule", "RHT")
    if rule not in {"RHT", "LHT"}:
        findings.repaired("road.rule", element, f"rule {rule!r} is unknown", "set to RHT")
        element.set("rule", "RHT")
        return "RHT"
    return rule


def _type(element: Element, findings: Findings) -> RoadType:
    name = element.get("type")
    if name is None and element.get("typ") is not None:
        findings.repaired(
            "attribute.renamed", element, "typ is used for type", "renamed", Severity.INFO
        )
        name = str(element.attrib.pop("typ"))
        element.set("type", name)
    limit = element.find("speed")
    return RoadType(
        number(element, "s", findings),
        name or "unknown",
        element.get("country", ""),
        0.0 if limit is None else speed(limit, findings),
    )


def _link(link: Element | None, tag: str, findings: Findings) -> RoadLink | None:
    end = None if link is None else _only(link, tag, findings)
    if end is None or not end.get("elementId"):
        return None
    return RoadLink(
        end.get("elementType", "road"),
        end.get("elementId", ""),
        end.get("contactPoint", ""),
        number(end, "elementS", findings, math.nan),
        end.get("elementDir", ""),
    )
