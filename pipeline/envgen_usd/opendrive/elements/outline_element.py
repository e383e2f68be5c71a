"""Reads outlines of objects (13.3)."""

import numpy as np

from envgen_usd.models.road_objects import Outline
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import number

_CORNERS = {
    "cornerRoad": ("s", "t", "dz", "height"),
    "cornerLocal": ("u", "v", "z", "height"),
}


def read_outlines(element: Element, findings: Findings) -> tuple[Outline, ...]:
    """Reads the outlines of an object: direct children (1.4) and in an outlines element (1.5)."""
    elements = list(element.iterchildren("outline"))
    for group in element.iterchildren("outlines"):
        elements += group.iterchildren("outline")
    outlines = (_outline(each, findings) for each in elements)
    return tuple(outline for outline in outlines if outline is not None)


def _outline(element: Element, findings: Findings) -> Outline | None:
    corners = list(element.iterchildren(*_CORNERS))
    if len(corners) < 2:
        text = f"the outline has {len(corners)} corners"
        findings.repaired("outline.corners", element, text, "outline left out")
        remove(element)
        return None
    tag = str(corners[0].tag)
    for corner in corners:
        if corner.tag != tag:
            text = f"a {corner.tag} among {tag} corners"
            findings.repaired("outline.mixed", corner, text, "corner left out")
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
