"""Removes roads without length between two roads, and links their neighbours."""

from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.elements.plan_view_element import SHORTEST
from envgen_usd.opendrive.elements.relinking import relink

_OPPOSITE = {"predecessor": "successor", "successor": "predecessor"}
_SIDE_AT = {"start": "predecessor", "end": "successor"}


def bypass_empty_roads(root: Element, findings: Findings) -> None:
    """Removes roads shorter than the shortest usable geometry.

    Only roads with a single lane section between two roads are removed here. The road reader leaves
    out the others without linking their neighbours.

    Args:
        root: The OpenDRIVE element; changed in place.
        findings: Collects the issues.
    """
    roads = {road.get("id", ""): road for road in root.iterchildren("road")}
    for id_, road in list(roads.items()):
        if _has_length(road):
            continue
        ends = {side: road.find(f"link/{side}") for side in _OPPOSITE}
        before, after = (_neighbour(end, roads, road) for end in ends.values())
        sections = road.findall("lanes/laneSection")
        if before is None or after is None or len(sections) != 1:
            continue
        action = "road left out and its neighbours linked"
        findings.repaired("road.empty", road, "the road has no length", action)
        _link(before, ends["predecessor"], ends["successor"], sections[0], "successor")
        _link(after, ends["successor"], ends["predecessor"], sections[0], "predecessor")
        del roads[id_]
        remove(road)


def _has_length(road: Element) -> bool:
    """Returns whether a road has a length, or none that could be told."""
    lengths = []
    for geometry in road.iterfind("planView/geometry"):
        length = read(geometry.get("length", "0"))
        if length is None or length >= SHORTEST:
            return True
        lengths.append(length)
    return not lengths or sum(lengths) >= SHORTEST


def _neighbour(end: Element | None, roads: dict[str, Element], road: Element) -> Element | None:
    if end is None or end.get("elementType") != "road" or end.get("contactPoint") not in _SIDE_AT:
        return None
    neighbour = roads.get(end.get("elementId", ""))
    return None if neighbour is road else neighbour


def _link(
    road: Element, near: Element | None, far: Element | None, middle: Element, side: str
) -> None:
    """Links a neighbour to the road beyond the empty road.

    Args:
        road: The neighbour.
        near: Link of the empty road to the neighbour.
        far: Link of the empty road to the road beyond.
        middle: Lane section of the empty road.
        side: Direction from the middle's lanes to the road beyond.
    """
    if near is None or far is None:
        return
    near_side = _SIDE_AT[near.get("contactPoint", "end")]
    end = road.find(f"link/{near_side}")
    if end is None:
        return
    for name in ("elementType", "elementId", "contactPoint"):
        end.set(name, far.get(name, ""))
    sections = road.findall("lanes/laneSection")
    if not sections:
        return
    relink(sections[0 if near_side == "predecessor" else -1], near_side, middle, side)
