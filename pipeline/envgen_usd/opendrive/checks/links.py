"""Links between roads (8.2, 11.5): they lead somewhere, to the right end, to lanes that exist."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.road import Road, RoadLink
from envgen_usd.opendrive.checks.index import Index
from envgen_usd.opendrive.checks.joined import Joined
from envgen_usd.opendrive.findings import Element, Findings, remove

NEAR = 0.1
"""Metres within which an end counts as touched."""
FAR = 1.0
"""Metres beyond which an end counts as missed."""
_SIDES = ("predecessor", "successor")


@dataclass(frozen=True)
class _Known:
    """What links can lead to: road ends (2 x 2: start and end, x and y) and junctions."""

    ends: Mapping[str, FloatArray]
    junctions: Collection[str]

    def has(self, kind: str, id_: str) -> bool:
        return id_ in (self.ends if kind == "road" else self.junctions)


def mend_links(
    roads: dict[str, Road],
    junctions: Collection[str],
    joined: Joined,
    index: Index,
    findings: Findings,
) -> dict[str, Road]:
    """Mends the roads' links.

    1. A link to an element that is not there is left out.
    2. A link to a road that names no end, or the end that is far away where the other is near,
       gets the near end.
    3. A link that the linked road does not answer is reported.

    Args:
        roads: By id, in the order of `joined`.
        junctions: Ids of the junctions.
        joined: Geometry of the roads.
        index: Elements; mended.
        findings: Takes the issues.

    Returns:
        The roads, with their links mended.
    """
    ends = {
        road: np.stack([joined.start[first, :2], joined.end[last, :2]])
        for road, first, last in zip(roads, joined.first, joined.last, strict=True)
    }
    known = _Known(ends, junctions)
    mended = dict(roads)
    for road in roads.values():
        element = index.roads[road.id]
        start, end = ends[road.id]
        before = _mend(road.predecessor, element.find("link/predecessor"), start, known, findings)
        after = _mend(road.successor, element.find("link/successor"), end, known, findings)
        if before is not road.predecessor or after is not road.successor:
            mended[road.id] = replace(road, predecessor=before, successor=after)
    for road in mended.values():
        _report_one_sided(road, mended, index, findings)
    return mended


def _mend(
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
            findings.mended("link.unknown", element, text, "link left out")
            remove(element)
            return None
        text = f"{link.id} is no {link.element} but a {other}"
        findings.mended("link.element_type", element, text, f"taken as a {other}")
        element.set("elementType", other)
        link = replace(link, element=other)
    if link.element == "road" and np.isnan(link.s):
        return _mend_contact(link, element, here, known.ends[link.id], findings)
    return link


def _mend_contact(
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
    findings.mended("link.contact_point", element, text, f"taken as {nearer}, which is near")
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
            element = index.roads[road.id].find(f"link/{side}")
            assert element is not None
            text = f"the {link.contact_point} of road {link.id} is not linked to this road"
            findings.noted("link.one_sided", element, text, Severity.INFO)
