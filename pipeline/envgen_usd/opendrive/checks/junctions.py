"""Junctions: their connections name roads and lanes that exist (chapter 12)."""

from collections.abc import Mapping
from dataclasses import replace

from envgen_usd.errors import Severity
from envgen_usd.models.junctions import Connection, Junction
from envgen_usd.models.road import Road
from envgen_usd.opendrive.checks.index import Index, lane_ids
from envgen_usd.opendrive.findings import Element, Findings, remove


def mend_junctions(
    junctions: dict[str, Junction], roads: Mapping[str, Road], index: Index, findings: Findings
) -> dict[str, Junction]:
    """Mends the junctions.

    1. A connection that names a road that is not there is left out.
    2. A connection without contact point gets the end of the connecting road that is linked to
       the incoming road.
    3. A lane link to a lane that is not there is left out.
    4. A junction that only its roads name is added.

    Args:
        junctions: By id.
        roads: By id, with mended links.
        index: Elements; mended.
        findings: Takes the issues.

    Returns:
        The junctions by id, mended.
    """
    mended = {}
    for id_, junction in junctions.items():
        elements = list(index.junctions[id_].iterchildren("connection"))
        pairs = zip(junction.connections, elements, strict=True)
        found = [_mend(each, element, roads, findings) for each, element in pairs]
        mended[id_] = replace(junction, connections=tuple(each for each in found if each))
    for road in roads.values():
        if road.junction and road.junction not in mended:
            element = index.roads[road.id]
            text = f"there is no junction {road.junction}"
            findings.mended("junction.missing", element, text, "junction added")
            attributes = {"id": road.junction, "name": ""}
            index.root.append(index.root.makeelement("junction", attributes))
            mended[road.junction] = Junction(road.junction, "", "default")
    return mended


def _mend(
    connection: Connection, element: Element, roads: Mapping[str, Road], findings: Findings
) -> Connection | None:
    named = (connection.incoming_road, connection.connecting_road)
    unknown = [road for road in named if road and road not in roads]
    if unknown:
        text = f"there is no road {' and no road '.join(unknown)}"
        findings.mended("junction.connection", element, text, "connection left out")
        remove(element)
        return None
    if not (connection.connecting_road and connection.incoming_road):
        return connection
    if connection.contact_point not in {"start", "end"}:
        connection = _mend_contact(connection, element, roads, findings)
    return _mend_lane_links(connection, element, roads, findings)


def _mend_contact(
    connection: Connection, element: Element, roads: Mapping[str, Road], findings: Findings
) -> Connection:
    after = roads[connection.connecting_road].successor
    at_end = after is not None and after.id == connection.incoming_road
    point = "end" if at_end else "start"
    findings.mended(
        "junction.contact_point", element, "contactPoint is missing", f"taken as {point}"
    )
    element.set("contactPoint", point)
    return replace(connection, contact_point=point)


def _mend_lane_links(
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
        ids = int(float(link.get("from", "0"))), int(float(link.get("to", "0")))
        if ids not in kept:
            text = f"lanes {ids[0]} and {ids[1]} are not both there"
            findings.mended("junction.lane_link", link, text, "link left out", Severity.WARNING)
            remove(link)
    return replace(connection, lane_links=kept)
