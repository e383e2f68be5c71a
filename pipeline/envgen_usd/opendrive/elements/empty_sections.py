"""Lane sections without length: left out, and the lanes on both sides linked past them."""

from copy import copy

from envgen_usd.opendrive.findings import Element, remove

_SIDES = ("left", "center", "right")


def leave_out(section: Element, before: Element | None, after: Element | None) -> None:
    """Takes a lane section out of its road.

    Args:
        section: The section; its lanes' links are handed on.
        before: The section before it, if there is one.
        after: The section after it, if there is one.
    """
    middle = _lanes(section)
    if before is not None:
        for lane in _lanes(before).values():
            _relink(lane, "successor", middle)
    if after is not None:
        for lane in _lanes(after).values():
            _relink(lane, "predecessor", middle)
    remove(section)


def _relink(lane: Element, side: str, middle: dict[str, Element]) -> None:
    """Replaces links into the middle section by that lane's own links on the same side."""
    for link in list(lane.iterfind(f"link/{side}")):
        parent, passed = link.getparent(), middle.get(link.get("id", ""))
        assert parent is not None
        for further in passed.iterfind(f"link/{side}") if passed is not None else ():
            parent.append(copy(further))
        parent.remove(link)


def _lanes(section: Element) -> dict[str, Element]:
    return {
        lane.get("id", ""): lane
        for side in section.iterchildren(*_SIDES)
        for lane in side.iterchildren("lane")
    }
