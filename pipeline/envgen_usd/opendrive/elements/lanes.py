"""A lane of a lane section (11.4 to 11.8)."""

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.lanes import Lane
from envgen_usd.models.records import Record
from envgen_usd.opendrive.elements.cubics import NAMES, read_cubics
from envgen_usd.opendrive.elements.numbers import number, read, write
from envgen_usd.opendrive.elements.records import leftovers, record
from envgen_usd.opendrive.elements.road_marks import read_marks
from envgen_usd.opendrive.elements.units import speed
from envgen_usd.opendrive.findings import Element, Findings, remove

_ATTRIBUTES = frozenset({"id", "type", "level", "direction"})
_NO_ROWS_2 = np.empty((0, 2))
_NO_ROWS_3 = np.empty((0, 3))
_Groups = dict[str, list[Element]]


def read_lane(element: Element, id_: int, layer: str, findings: Findings) -> Lane:
    """Reads a lane.

    Args:
        element: The lane; mended where it has to be.
        id_: Its id.
        layer: Lane layer it belongs to; links to other layers are not taken.
        findings: Takes the issues.
    """
    groups: _Groups = {}
    for child in element.iterchildren("*"):
        groups.setdefault(child.tag, []).append(child)
    type_ = element.get("type")
    if type_ is None and id_ != 0:
        findings.mended("lane.no_type", element, "type is missing", "taken as none")
        element.set("type", "none")
    width, border = _extent(element, id_, groups, findings)
    predecessors, successors = _links(groups.pop("link", ()), layer, findings)
    marks = read_marks(groups.pop("roadMark", ()), findings)
    return Lane(
        id_,
        type_ or "none",
        element.get("level") in {"true", "1"},
        width,
        border,
        _heights(groups.pop("height", ()), findings),
        marks,
        predecessors,
        successors,
        _speeds(groups.pop("speed", ()), findings),
        _material(groups),
        element.get("direction", "standard"),
        _extra(element, groups),
    )


def _extent(
    element: Element, id_: int, groups: _Groups, findings: Findings
) -> tuple[Cubics, Cubics]:
    """Width, or border where no width is given; the centre lane has neither."""
    widths, borders = groups.pop("width", []), groups.pop("border", [])
    if id_ == 0:
        return NO_CUBICS, NO_CUBICS
    width = read_cubics(widths, "sOffset", findings)
    if len(width.start) and borders:
        findings.mended(
            "lane.width_and_border", element, "width and border are given", "border left out"
        )
        for unused in borders:
            remove(unused)
        return width, NO_CUBICS
    border = read_cubics(borders, "sOffset", findings)
    if len(width.start) and width.start[0] > 0:
        text = f"the first width is at sOffset {width.start[0]:g}"
        findings.mended("lane.late_width", element, text, "it holds from the section's start on")
    if len(border.start) and not (id_ * border.coefficients[:, 0] > 0).any():
        border = _turn_border(border, element, findings)
    if not len(width.start) and not len(border.start):
        findings.mended("lane.no_width", element, "neither width nor border", "taken as 0 m wide")
        names = ("sOffset", "a", "b", "c", "d")
        element.append(element.makeelement("width", dict.fromkeys(names, "0")))
        width = Cubics(np.zeros(1), np.zeros((1, 4)))
    return width, border


def _turn_border(border: Cubics, element: Element, findings: Findings) -> Cubics:
    """A border on the wrong side of the reference line, on the right one."""
    if not border.coefficients[:, 0].any():
        return border
    text = "its border is on the other side of the reference line"
    findings.mended("lane.border_sign", element, text, "sign of the border turned")
    for piece in element.iterchildren("border"):
        for name in NAMES:
            piece.set(name, write(-number(piece, name, findings)))
    return Cubics(border.start, -border.coefficients)


def _links(
    links: list[Element] | tuple[()], layer: str, findings: Findings
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    found: dict[str, list[int]] = {"predecessor": [], "successor": []}
    for link in links:
        for end in list(link.iterchildren("predecessor", "successor")):
            id_ = lane_id(end.get("id", ""))
            if id_ is None:
                text = f"id={end.get('id')!r} is no lane id"
                findings.mended("lane.link_id", end, text, "link left out")
                remove(end)
            elif end.get("layer", layer) == layer:
                found[end.tag].append(id_)
    return tuple(found["predecessor"]), tuple(found["successor"])


def lane_id(text: str) -> int | None:
    """Lane id in a text, also where it is written as ``-1.0``; nothing where there is none."""
    try:
        return int(text)
    except ValueError:
        value = read(text)
        return int(value) if value is not None and value.is_integer() else None


def _heights(elements: list[Element] | tuple[()], findings: Findings) -> FloatArray:
    if not elements:
        return _NO_ROWS_3
    rows = []
    for element in elements:
        for name in ("inner", "outer"):
            old = f"height{name.capitalize()}"
            if element.get(name) is None and element.get(old) is not None:
                text = f"{old} stands for {name}"
                findings.mended("attribute.renamed", element, text, "renamed", Severity.INFO)
                element.set(name, element.attrib.pop(old))
        rows.append([number(element, name, findings) for name in ("sOffset", "inner", "outer")])
    return np.array(sorted(rows))


def _speeds(elements: list[Element] | tuple[()], findings: Findings) -> FloatArray:
    if not elements:
        return _NO_ROWS_2
    rows = [(number(each, "sOffset", findings), speed(each, findings)) for each in elements]
    return np.array(sorted(rows))


def _material(groups: _Groups) -> str:
    materials = groups.get("material")
    return materials[0].get("surface", "") if materials else ""


def _extra(element: Element, groups: _Groups) -> tuple[Record, ...]:
    rest = [record(child) for group in groups.values() for child in group]
    return (*leftovers(element, _ATTRIBUTES), *rest)
