"""Lane links within a road (11.5): they name lanes that exist."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road, RoadLink
from envgen_usd.opendrive.checks.index import Index, lane_ids
from envgen_usd.opendrive.findings import Element, Findings, remove


def mend_lane_links(roads: dict[str, Road], index: Index, findings: Findings) -> dict[str, Road]:
    """Leaves out links to lanes that the linked section does not have.

    Args:
        roads: By id, with mended road links.
        index: Elements; mended.
        findings: Takes the issues.

    Returns:
        The roads, with their lane links mended.
    """
    ids = {road.id: [lane_ids(section) for section in road.sections] for road in roads.values()}
    mended = dict(roads)
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
            mended[road.id] = replace(road, sections=tuple(sections))
    return mended


def with_lane(section: LaneSection, lane: Lane) -> LaneSection:
    """The section with another lane in place of the one of that id."""
    left, right = (
        tuple(lane if each.id == lane.id else each for each in lanes)
        for lanes in (section.left, section.right)
    )
    return replace(section, left=left, right=right)


def _linked(link: RoadLink | None, ids: Mapping[str, list[set[int]]]) -> set[int] | None:
    """Lanes at the linked end; none where the link does not say which lanes they are."""
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
            id_ = int(float(element.get("id", "0")))
            if id_ not in ids:
                text = f"there is no lane {id_}"
                findings.mended("lane.link_unknown", element, text, "link left out")
                remove(element)
