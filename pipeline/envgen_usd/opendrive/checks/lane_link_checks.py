"""Checks that lane links within a road refer to existing lanes (11.5)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road, RoadLink
from envgen_usd.opendrive.checks.element_index import Index, lane_ids
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.elements.lane_element import lane_id


def repair_lane_links(roads: dict[str, Road], index: Index, findings: Findings) -> dict[str, Road]:
    """Removes links to lanes that the linked section lacks.

    Args:
        roads: Roads by id, with repaired road links.
        index: XML elements; repaired in place.
        findings: Collects the issues.

    Returns:
        The roads with repaired lane links.
    """
    ids = {road.id: [lane_ids(section) for section in road.sections] for road in roads.values()}
    repaired = dict(roads)
    for road in roads.values():
        before = [_linked(road.predecessor, ids), *ids[road.id][:-1]]
        after = [*ids[road.id][1:], _linked(road.successor, ids)]
        sections = list(road.sections)
        for number, section in enumerate(road.sections):
            for lane in (*section.left, *section.right):
                kept = (
                    _known(lane.predecessors, before[number]),
                    _known(lane.successors, after[number]),
                )
                if kept == (lane.predecessors, lane.successors):
                    continue
                _leave_out(index.lane(road.id, number, lane.id), kept, findings)
                fresh = replace(lane, predecessors=kept[0], successors=kept[1])
                sections[number] = with_lane(sections[number], fresh)
        if any(new is not old for new, old in zip(sections, road.sections, strict=True)):
            repaired[road.id] = replace(road, sections=tuple(sections))
    return repaired


def with_lane(section: LaneSection, lane: Lane) -> LaneSection:
    """Returns the section with the lane of the same id replaced."""
    left, right = (
        tuple(lane if each.id == lane.id else each for each in lanes)
        for lanes in (section.left, section.right)
    )
    return replace(section, left=left, right=right)


def _linked(link: RoadLink | None, ids: Mapping[str, list[set[int]]]) -> set[int] | None:
    """Returns the lanes at the linked end; `None` where the link leaves them open."""
    if link is None or link.element != "road" or not link.contact_point:
        return None
    return ids[link.id][0 if link.contact_point == "start" else -1]


def _known(links: tuple[int, ...], there: set[int] | None) -> tuple[int, ...]:
    if there is None or there.issuperset(links):
        return links
    return tuple(id_ for id_ in links if id_ in there)


def _leave_out(lane: Element, kept: Sequence[tuple[int, ...]], findings: Findings) -> None:
    for side, ids in zip(("predecessor", "successor"), kept, strict=True):
        for element in list(lane.iterfind(f"link/{side}")):
            id_ = lane_id(element.get("id", ""))
            if id_ not in ids:
                text = f"there is no lane {id_}"
                findings.repaired("lane.link_unknown", element, text, "link left out")
                remove(element)
