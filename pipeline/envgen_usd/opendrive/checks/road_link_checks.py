"""Checks links between roads (8.2, 11.5): existing target, correct end, existing lanes."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road, RoadLink
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.checks.joined_plan_views import Joined
from envgen_usd.opendrive.document.findings import Element, Findings, remove

NEAR = 0.1
"""Largest distance in metres between road ends that touch."""
FAR = 1.0
"""Least distance in metres between road ends that do not meet."""
_SIDES = ("predecessor", "successor")


@dataclass(frozen=True)
class _Known:
    """Targets of links: road ends (2 x 2: start and end, x and y) and junctions."""

    ends: Mapping[str, FloatArray]
    junctions: Collection[str]

    def has(self, kind: str, id_: str) -> bool:
        return id_ in (self.ends if kind == "road" else self.junctions)


def repair_links(
    roads: dict[str, Road],
    junctions: Collection[str],
    joined: Joined,
    index: Index,
    findings: Findings,
) -> dict[str, Road]:
    """Repairs the links of the roads.

    1. A link to a missing element is left out.
    2. A link without a contact point, or to the distant end of a nearby road, receives the nearby
       end.
    3. A link without a link back is reported.

    Args:
        roads: Roads by id, in the order of `joined`.
        junctions: Ids of the junctions.
        joined: Geometry of the roads.
        index: XML elements; repaired in place.
        findings: Collects the issues.

    Returns:
        The roads with repaired links.
    """
    ends = {
        road: np.stack([joined.start[first, :2], joined.end[last, :2]])
        for road, first, last in zip(roads, joined.first, joined.last, strict=True)
    }
    known = _Known(ends, junctions)
    repaired = dict(roads)
    for road in roads.values():
        element = index.roads[road.id]
        start, end = ends[road.id]
        before = _repair(road.predecessor, element.find("link/predecessor"), start, known, findings)
        after = _repair(road.successor, element.find("link/successor"), end, known, findings)
        if before is not road.predecessor or after is not road.successor:
            repaired[road.id] = replace(road, predecessor=before, successor=after)
    for road in repaired.values():
        _report_one_sided(road, repaired, index, findings)
    return repaired


def _repair(
    link: RoadLink | None,
    element: Element | None,
    here: FloatArray,
    known: _Known,
    findings: Findings,
) -> RoadLink | None:
    if link is None or element is None:
        return link
    if not known.has(link.element, link.id):
        other = "junction" if link.element == "road" else "road"
        if not known.has(other, link.id):
            text = f"there is no {link.element} {link.id}"
            findings.repaired("link.unknown", element, text, "link left out")
            remove(element)
            return None
        text = f"{link.id} is not a {link.element} but a {other}"
        findings.repaired("link.element_type", element, text, f"treated as a {other}")
        element.set("elementType", other)
        link = replace(link, element=other)
    if link.element == "road" and np.isnan(link.s):
        return _repair_contact(link, element, here, known.ends[link.id], findings)
    return link


def _repair_contact(
    link: RoadLink, element: Element, here: FloatArray, ends: FloatArray, findings: Findings
) -> RoadLink:
    start, end = np.hypot(*(ends - here).T)
    nearer = "start" if start <= end else "end"
    if link.contact_point not in {"start", "end"}:
        text = "contactPoint is missing"
    elif link.contact_point != nearer and min(start, end) < NEAR and max(start, end) > FAR:
        text = f"the {link.contact_point} of road {link.id} is {max(start, end):.2f} m away"
    else:
        return link
    findings.repaired("link.contact_point", element, text, f"set to {nearer}, the near end")
    element.set("contactPoint", nearer)
    return replace(link, contact_point=nearer)


def _report_one_sided(
    road: Road, roads: Mapping[str, Road], index: Index, findings: Findings
) -> None:
    for side, link in zip(_SIDES, (road.predecessor, road.successor), strict=True):
        if link is None or link.element != "road" or not np.isnan(link.s):
            continue
        other = roads[link.id]
        answer = other.predecessor if link.contact_point == "start" else other.successor
        if road.junction and not other.junction:
            continue  # that road is linked to the junction
        if answer is None or answer.id != road.id:
            element = index.roads[road.id]
            place = element.find(f"link/{side}")
            text = f"the {link.contact_point} of road {link.id} is not linked to this road"
            place = element if place is None else place
            findings.noted("link.one_sided", place, text, Severity.INFO)
