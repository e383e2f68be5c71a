"""Roads (chapter 8)."""

import math

from envgen_usd.errors import Severity
from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.road import Road, RoadLink, RoadType
from envgen_usd.opendrive.elements.lane_sections import read_lane_layers
from envgen_usd.opendrive.elements.numbers import needed, number, write
from envgen_usd.opendrive.elements.objects import read_objects
from envgen_usd.opendrive.elements.profiles import read_cross_section, read_profile, read_shapes
from envgen_usd.opendrive.elements.records import leftovers, others
from envgen_usd.opendrive.elements.reference_line import read_plan_view
from envgen_usd.opendrive.elements.signals import read_signals
from envgen_usd.opendrive.elements.units import speed
from envgen_usd.opendrive.findings import Element, Findings, Hostile, Unusable, line_of, remove

LENGTH_TOLERANCE = 0.01
"""Difference in metres between the road's length and its geometries' that is not reported."""
LONGEST = 1e6
"""Length in metres beyond which a road is refused."""
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
        element: The road, with an id that no other road has; mended where it has to be.
        findings: Takes the issues.

    Raises:
        Unusable: It cannot be placed.
        Hostile: It would take more samples than any road needs.
    """
    plan_element = _only(element, "planView", findings)
    if plan_element is None:
        raise Unusable(element, "road.no_plan_view", "no planView")
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
    """The child of a tag of which there may be one; further ones are left out."""
    found = element.findall(tag)
    for again in found[1:]:
        findings.mended("element.repeated", again, f"a second {tag}", "left out")
        remove(again)
    return found[0] if found else None


def _length(element: Element, plan_view: PlanView, findings: Findings) -> float:
    """Length of the reference line, which the attribute has to agree with."""
    length = float(plan_view.s[-1] + plan_view.length[-1])
    if not max(length, plan_view.length.max()) <= LONGEST:
        raise Hostile(element, f"a road of {length:g} m")
    declared = needed(element, "length", findings, length)
    if abs(declared - length) > LENGTH_TOLERANCE:
        text = f"length {declared:g} m, but its geometries are {length:g} m long"
        findings.mended("road.length", element, text, f"taken as {length:g} m")
        element.set("length", write(length))
    return length


def _rule(element: Element, findings: Findings) -> str:
    rule = element.get("rule", "RHT")
    if rule not in {"RHT", "LHT"}:
        findings.mended("road.rule", element, f"rule {rule!r} is not known", "taken as RHT")
        element.set("rule", "RHT")
        return "RHT"
    return rule


def _type(element: Element, findings: Findings) -> RoadType:
    name = element.get("type")
    if name is None and element.get("typ") is not None:
        findings.mended(
            "attribute.renamed", element, "typ stands for type", "renamed", Severity.INFO
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
