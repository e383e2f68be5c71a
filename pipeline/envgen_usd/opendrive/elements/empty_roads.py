"""Roads without length between two roads: left out, and the roads on both sides linked."""

from envgen_usd.opendrive.elements.numbers import read
from envgen_usd.opendrive.elements.reference_line import SHORTEST
from envgen_usd.opendrive.elements.relinking import relink
from envgen_usd.opendrive.findings import Element, Findings, remove

_OPPOSITE = {"predecessor": "successor", "successor": "predecessor"}
_SIDE_AT = {"start": "predecessor", "end": "successor"}


def bypass_empty_roads(root: Element, findings: Findings) -> None:
    """Takes roads shorter than any geometry that counts out of the file.

    Only roads with one lane section that lie between two roads are taken out; others are left to
    the reader of roads, which leaves them out without linking their neighbours.

    Args:
        root: The OpenDRIVE element; changed.
        findings: Takes the issues.
    """
    roads = {road.get("id", ""): road for road in root.iterchildren("road")}
    for id_, road in list(roads.items()):
        lengths = [read(each.get("length", "0")) for each in road.iterfind("planView/geometry")]
        if not lengths or None in lengths or sum(filter(None, lengths)) >= SHORTEST:
            continue
        ends = {side: road.find(f"link/{side}") for side in _OPPOSITE}
        before, after = (_neighbour(end, roads, road) for end in ends.values())
        sections = road.findall("lanes/laneSection")
        if before is None or after is None or len(sections) != 1:
            continue
        action = "road left out and its neighbours linked"
        findings.mended("road.empty", road, "a road without length", action)
        _link(before, ends["predecessor"], ends["successor"], sections[0], "successor")
        _link(after, ends["successor"], ends["predecessor"], sections[0], "predecessor")
        del roads[id_]
        remove(road)


def _neighbour(end: Element | None, roads: dict[str, Element], road: Element) -> Element | None:
    if end is None or end.get("elementType") != "road" or end.get("contactPoint") not in _SIDE_AT:
        return None
    found = roads.get(end.get("elementId", ""))
    return None if found is road else found


def _link(
    road: Element, near: Element | None, far: Element | None, middle: Element, side: str
) -> None:
    """Links a neighbour to what lies beyond the empty road.

    Args:
        road: The neighbour.
        near: Link of the empty road that leads to it.
        far: Link of the empty road that leads on.
        middle: Lane section of the empty road.
        side: Side of the middle's lanes that leads on.
    """
    if near is None or far is None:
        return
    own_side = _SIDE_AT[near.get("contactPoint", "end")]
    own = road.find(f"link/{own_side}")
    if own is None:
        return
    for name in ("elementType", "elementId", "contactPoint"):
        own.set(name, far.get(name, ""))
    sections = road.findall("lanes/laneSection")
    if not sections:
        return
    relink(sections[0 if own_side == "predecessor" else -1], own_side, middle, side)
