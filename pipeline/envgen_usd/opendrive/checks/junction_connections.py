"""Checks that connections of junctions refer to existing roads and lanes (chapter 12)."""

from collections.abc import Mapping
from dataclasses import replace

from envgen_usd.errors import Severity
from envgen_usd.models.junctions import Connection, Junction
from envgen_usd.models.road import Road
from envgen_usd.opendrive.checks.element_index import Index, lane_ids
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.elements.lane_element import lane_id


def repair_junctions(
    junctions: dict[str, Junction], roads: Mapping[str, Road], index: Index, findings: Findings
) -> dict[str, Junction]:
    """Repairs the junctions.

    1. A connection to a missing road is left out.
    2. A connection without a contact point gets the end of the connecting road that links to the
       incoming road.
    3. A lane link to a missing lane is left out.
    4. A missing junction that roads refer to is added.

    Args:
        junctions: Junctions by id.
        roads: Roads by id, with repaired links.
        index: XML elements; repaired in place.
        findings: Collects the issues.

    Returns:
        The repaired junctions by id.
    """
    repaired = {}
    for id_, junction in junctions.items():
        elements = list(index.junctions[id_].iterchildren("connection"))
        pairs = zip(junction.connections, elements, strict=True)
        connections = [_repair(each, element, roads, findings) for each, element in pairs]
        repaired[id_] = replace(junction, connections=tuple(each for each in connections if each))
    for road in roads.values():
        if road.junction and road.junction not in repaired:
            element = index.roads[road.id]
            text = f"there is no junction {road.junction}"
            findings.repaired("junction.missing", element, text, "junction added")
            attributes = {"id": road.junction, "name": ""}
            index.root.append(index.root.makeelement("junction", attributes))
            repaired[road.junction] = Junction(road.junction, "", "default")
    return repaired


def _repair(
    connection: Connection, element: Element, roads: Mapping[str, Road], findings: Findings
) -> Connection | None:
    named = (connection.incoming_road, connection.connecting_road)
    unknown = [road for road in named if road and road not in roads]
    if unknown:
        text = f"there is no road {' and no road '.join(unknown)}"
        findings.repaired("junction.connection", element, text, "connection left out")
        remove(element)
        return None
    if not (connection.connecting_road and connection.incoming_road):
        return connection
    if connection.contact_point not in {"start", "end"}:
        connection = _repair_contact(connection, element, roads, findings)
    return _repair_lane_links(connection, element, roads, findings)


def _repair_contact(
    connection: Connection, element: Element, roads: Mapping[str, Road], findings: Findings
) -> Connection:
    after = roads[connection.connecting_road].successor
    at_end = after is not None and after.id == connection.incoming_road
    point = "end" if at_end else "start"
    findings.repaired(
        "junction.contact_point", element, "contactPoint is missing", f"set to {point}"
    )
    element.set("contactPoint", point)
    return replace(connection, contact_point=point)


def _repair_lane_links(
    connection: Connection, element: Element, roads: Mapping[str, Road], findings: Findings
) -> Connection:
    incoming = roads[connection.incoming_road]
    outer = lane_ids(incoming.sections[0]) | lane_ids(incoming.sections[-1])
    road = roads[connection.connecting_road]
    inner = lane_ids(road.sections[0 if connection.contact_point == "start" else -1])
    kept = tuple(link for link in connection.lane_links if link[0] in outer and link[1] in inner)
    if len(kept) == len(connection.lane_links):
        return connection
    for link in list(element.iterchildren("laneLink")):
        ids = lane_id(link.get("from", "")), lane_id(link.get("to", ""))
        if ids not in kept:
            text = f"lane {ids[0]} or lane {ids[1]} does not exist"
            findings.repaired("junction.lane_link", link, text, "link left out", Severity.WARNING)
            remove(link)
    return replace(connection, lane_links=kept)
