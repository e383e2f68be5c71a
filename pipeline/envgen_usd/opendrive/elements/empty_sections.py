"""Lane sections without length: left out, and the lanes on both sides linked past them."""

from envgen_usd.opendrive.elements.relinking import relink
from envgen_usd.opendrive.findings import Element, remove


def leave_out(section: Element, before: Element | None, after: Element | None) -> None:
    """Takes a lane section out of its road.

    Args:
        section: The section; its lanes' links are handed on.
        before: The section before it, if there is one.
        after: The section after it, if there is one.
    """
    if before is not None:
        relink(before, "successor", section, "successor")
    if after is not None:
        relink(after, "predecessor", section, "predecessor")
    remove(section)
