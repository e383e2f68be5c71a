"""Outlines of objects (13.3)."""

import numpy as np

from envgen_usd.models.road_objects import Outline
from envgen_usd.opendrive.elements.numbers import number
from envgen_usd.opendrive.findings import Element, Findings, remove

_CORNERS = {
    "cornerRoad": ("s", "t", "dz", "height"),
    "cornerLocal": ("u", "v", "z", "height"),
}


def read_outlines(element: Element, findings: Findings) -> tuple[Outline, ...]:
    """Outlines of an object: bare ones (1.4) and those in an outlines element (1.5 and later)."""
    found = list(element.iterchildren("outline"))
    for group in element.iterchildren("outlines"):
        found += group.iterchildren("outline")
    outlines = (_outline(each, findings) for each in found)
    return tuple(outline for outline in outlines if outline is not None)


def _outline(element: Element, findings: Findings) -> Outline | None:
    corners = list(element.iterchildren(*_CORNERS))
    if len(corners) < 2:
        text = f"an outline with {len(corners)} corners"
        findings.mended("outline.corners", element, text, "outline left out")
        remove(element)
        return None
    tag = str(corners[0].tag)
    for corner in corners:
        if corner.tag != tag:
            text = f"a {corner.tag} among {tag} corners"
            findings.mended("outline.mixed", corner, text, "corner left out")
            remove(corner)
    kept = [corner for corner in corners if corner.tag == tag]
    rows = [[number(corner, name, findings) for name in _CORNERS[tag]] for corner in kept]
    table = np.array(rows)
    return Outline(
        table[:, :3],
        table[:, 3],
        tuple(corner.get("id", "") for corner in kept),
        tag == "cornerRoad",
        element.get("closed", "true") not in {"false", "0"},
        element.get("outer", "true") not in {"false", "0"},
        element.get("fillType", ""),
        element.get("laneType", ""),
    )
