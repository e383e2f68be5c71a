"""Lane links across a removed lane section."""

from envgen_usd.opendrive.document.findings import Element


def relink(section: Element, near_side: str, middle: Element, side: str) -> None:
    """Replaces links into a lane section by the links of that section.

    Args:
        section: Lane section with links into the middle; changed in place.
        near_side: Link direction from the section to the middle: ``predecessor`` or ``successor``.
        middle: The removed lane section.
        side: Link direction from the middle onwards.
    """
    through = _lanes(middle)
    for lane in _lanes(section).values():
        holders = lane.iterchildren("link")
        links = [(holder, link) for holder in holders for link in holder.iterchildren(near_side)]
        for parent, link in links:
            passed = through.get(link.get("id", ""))
            for further in passed.iterfind(f"link/{side}") if passed is not None else ():
                parent.append(parent.makeelement(near_side, {"id": further.get("id", "")}))
            parent.remove(link)


def _lanes(section: Element) -> dict[str, Element]:
    return {
        lane.get("id", ""): lane
        for side in section.iterchildren("left", "center", "right")
        for lane in side.iterchildren("lane")
    }
