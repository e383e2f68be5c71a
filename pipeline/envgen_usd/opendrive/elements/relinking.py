"""Lane links past something that is left out."""

from envgen_usd.opendrive.findings import Element


def relink(section: Element, own_side: str, middle: Element, side: str) -> None:
    """Replaces links into a lane section by that section's own links.

    Args:
        section: Lane section whose lanes link into the middle; changed.
        own_side: ``predecessor`` or ``successor``: the side on which the middle lies.
        middle: Lane section that is left out.
        side: Side of the middle's lanes that leads on.
    """
    through = _lanes(middle)
    for lane in _lanes(section).values():
        for link in list(lane.iterfind(f"link/{own_side}")):
            parent, passed = link.getparent(), through.get(link.get("id", ""))
            assert parent is not None
            for further in passed.iterfind(f"link/{side}") if passed is not None else ():
                parent.append(parent.makeelement(own_side, {"id": further.get("id", "")}))
            parent.remove(link)


def _lanes(section: Element) -> dict[str, Element]:
    return {
        lane.get("id", ""): lane
        for side in section.iterchildren("left", "center", "right")
        for lane in side.iterchildren("lane")
    }
