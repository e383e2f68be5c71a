"""Reads a lane of a lane section (11.4 to 11.8)."""

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.kept_records import Record
from envgen_usd.models.lanes import Lane
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import number, read, write
from envgen_usd.opendrive.elements.cubic_elements import NAMES, read_cubics
from envgen_usd.opendrive.elements.kept_elements import leftovers, record
from envgen_usd.opendrive.elements.road_mark_element import read_marks
from envgen_usd.opendrive.elements.speed_units import speed

_ATTRIBUTES = frozenset({"id", "type", "level", "direction"})
_NO_ROWS_2 = np.empty((0, 2))
_NO_ROWS_3 = np.empty((0, 3))
_Groups = dict[str, list[Element]]


def read_lane(element: Element, id_: int, layer: str, findings: Findings) -> Lane:
    """Reads a lane.

    Args:
        element: The lane; repaired in place.
        id_: Lane id.
        layer: Lane layer of the lane; links to other layers are ignored.
        findings: Collects the issues.
    """
    groups: _Groups = {}
    for child in element.iterchildren("*"):
        groups.setdefault(child.tag, []).append(child)
    type_ = element.get("type")
    if type_ is None and id_ != 0:
        findings.repaired("lane.no_type", element, "type is missing", "set to none")
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
    """Reads the width, or the border of a lane without a width; the centre lane has neither."""
    widths, borders = groups.pop("width", []), groups.pop("border", [])
    if id_ == 0:
        return NO_CUBICS, NO_CUBICS
    width = read_cubics(widths, "sOffset", findings)
    if len(width.start) and borders:
        findings.repaired(
            "lane.width_and_border", element, "the lane has width and border", "border left out"
        )
        for unused in borders:
            remove(unused)
        return width, NO_CUBICS
    border = read_cubics(borders, "sOffset", findings)
    if len(width.start) and width.start[0] > 0:
        text = f"the first width is at sOffset {width.start[0]:g}"
        findings.repaired("lane.late_width", element, text, "applied from the section's start")
    if len(border.start) and not (id_ * border.coefficients[:, 0] > 0).any():
        border = _turn_border(border, element, findings)
    if not len(width.start) and not len(border.start):
        findings.repaired(
            "lane.no_width", element, "the lane has no width and no border", "width set to 0 m"
        )
        names = ("sOffset", "a", "b", "c", "d")
        element.append(element.makeelement("width", dict.fromkeys(names, "0")))
        width = Cubics(np.zeros(1), np.zeros((1, 4)))
    return width, border


def _turn_border(border: Cubics, element: Element, findings: Findings) -> Cubics:
    """Negates a border on the wrong side of the reference line."""
    if not border.coefficients[:, 0].any():
        return border
    text = "the border is on the wrong side of the reference line"
    findings.repaired("lane.border_sign", element, text, "sign of the border inverted")
    for piece in element.iterchildren("border"):
        for name in NAMES:
            piece.set(name, write(-number(piece, name, findings)))
    return Cubics(border.start, -border.coefficients)


def _links(
    links: list[Element] | tuple[()], layer: str, findings: Findings
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    ids: dict[str, list[int]] = {"predecessor": [], "successor": []}
    for link in links:
        for end in list(link.iterchildren("predecessor", "successor")):
            id_ = lane_id(end.get("id", ""))
            if id_ is None:
                text = f"id={end.get('id')!r} is not a lane id"
                findings.repaired("lane.link_id", end, text, "link left out")
                remove(end)
            elif end.get("layer", layer) == layer:
                ids[end.tag].append(id_)
    return tuple(ids["predecessor"]), tuple(ids["successor"])


def lane_id(text: str) -> int | None:
    """Parses a lane id, also in the form ``-1.0``; `None` for any other text."""
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
                text = f"{old} is used for {name}"
                findings.repaired("attribute.renamed", element, text, "renamed", Severity.INFO)
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
