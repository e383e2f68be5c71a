"""Removes lane sections without length, and links the lanes on both sides."""

from envgen_usd.opendrive.document.findings import Element, remove
from envgen_usd.opendrive.elements.relinking import relink


def leave_out(section: Element, before: Element | None, after: Element | None) -> None:
    """Removes a lane section from its road.

    Args:
        section: The section; its neighbours take over the links of its lanes.
        before: The previous section; `None` at the start.
        after: The next section; `None` at the end.
    """
    if before is not None:
        relink(before, "successor", section, "successor")
    if after is not None:
        relink(after, "predecessor", section, "predecessor")
    remove(section)
