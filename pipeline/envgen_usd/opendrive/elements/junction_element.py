"""Reads junctions of all types (chapter 12)."""

from collections.abc import Mapping

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.junctions import BoundarySegment, Connection, ElevationGrid, Junction
from envgen_usd.models.plan_view import PlanView
from envgen_usd.opendrive.document.findings import Element, Findings, Unusable, line_of, remove
from envgen_usd.opendrive.document.number_attributes import needed, number, read
from envgen_usd.opendrive.elements.kept_elements import leftovers, others, record
from envgen_usd.opendrive.elements.lane_element import lane_id
from envgen_usd.opendrive.elements.plan_view_element import read_plan_view

_KNOWN = frozenset({"connection", "boundary", "elevationGrid", "planView"})
_SIDES = ("left", "right")
FARTHEST = 10_000.0
"""Largest extent of a junction in metres."""
MOST_HEIGHTS = 1_000_000
"""Largest number of heights in an elevation grid."""
_ATTRIBUTES = frozenset({"id", "name", "type", "mainRoad", "sStart", "sEnd", "orientation"})


def read_junction(element: Element, lengths: Mapping[str, float], findings: Findings) -> Junction:
    """Reads a junction.

    Args:
        element: The junction; repaired in place.
        lengths: Road lengths in metres by road id.
        findings: Collects the issues.
    """
    get = element.get
    if element.find("elevationGrid") is not None and element.find("planView") is None:
        text = "the elevationGrid has no planView"
        findings.noted("junction.elevation_grid", element, text)
    connections = (_connection(each, findings) for each in list(element.iterchildren("connection")))
    return Junction(
        get("id", ""),
        get("name", ""),
        get("type", "default"),
        tuple(connections),
        get("mainRoad", ""),
        number(element, "sStart", findings),
        number(element, "sEnd", findings),
        get("orientation", ""),
        _boundary(element, lengths, findings),
        _elevation_grid(element, findings),
        _plan_view(element, findings),
        (*leftovers(element, _ATTRIBUTES), *others(element, _KNOWN)),
        line_of(element),
    )


def _connection(element: Element, findings: Findings) -> Connection:
    links, extra = [], list(others(element, {"laneLink"}))
    for link in list(element.iterchildren("laneLink")):
        start, end = lane_id(link.get("from", "")), lane_id(link.get("to", ""))
        if start is None or end is None:
            text = f"from={link.get('from')!r} to={link.get('to')!r} are not lane ids"
            findings.repaired("junction.lane_link", link, text, "link left out")
            remove(link)
            continue
        links.append((start, end))
        if len(link.attrib) > 2:
            extra.append(record(link))
    return Connection(
        element.get("id", ""),
        element.get("incomingRoad", ""),
        element.get("connectingRoad", element.get("linkedRoad", "")),
        element.get("contactPoint", ""),
        tuple(links),
        tuple(extra),
    )


def _boundary(
    junction: Element, lengths: Mapping[str, float], findings: Findings
) -> tuple[BoundarySegment, ...]:
    boundary = junction.find("boundary")
    if boundary is None:
        return ()
    return tuple(_segment(each, lengths, findings) for each in boundary.iterchildren("segment"))


def _segment(element: Element, lengths: Mapping[str, float], findings: Findings) -> BoundarySegment:
    get = element.get
    road = get("roadId", "")
    start, end = (
        _place(element, name, lengths.get(road, 0.0), findings) for name in ("sStart", "sEnd")
    )
    return BoundarySegment(
        get("type", "lane"),
        road,
        get("contactPoint", ""),
        lane_id(get("boundaryLane", "0")) or 0,
        start,
        end,
        lane_id(get("jointLaneStart", "")),
        lane_id(get("jointLaneEnd", "")),
    )


def _place(element: Element, name: str, length: float, findings: Findings) -> float:
    """Returns the s of a boundary segment's end: a number, ``begin`` or ``end``."""
    text = element.get(name)
    if text in {"begin", "end"}:
        return 0.0 if text == "begin" else length
    return number(element, name, findings, float("nan"))


def _elevation_grid(junction: Element, findings: Findings) -> ElevationGrid | None:
    grid = junction.find("elevationGrid")
    if grid is None:
        return None
    spacing = needed(grid, "gridSpacing", findings, 1.0)
    rows = list(grid.iterchildren("elevation"))
    longest = max(
        (len((row.get(side) or "").split()) for row in rows for side in _SIDES), default=0
    )
    reach = spacing * max(longest, len(rows)) + abs(number(grid, "sStart", findings))
    if spacing <= 0 or not rows or reach > FARTHEST or len(rows) * longest > MOST_HEIGHTS:
        text = f"spacing {spacing:g} m, {len(rows)} rows of up to {longest} heights per side"
        findings.repaired("junction.elevation_grid", grid, text, "left out")
        remove(grid)
        return None
    return ElevationGrid(
        spacing,
        number(grid, "sStart", findings),
        tuple(_heights(row, "left", findings) for row in rows),
        np.array([needed(row, "center", findings) for row in rows]),
        tuple(_heights(row, "right", findings) for row in rows),
    )


def _heights(row: Element, side: str, findings: Findings) -> FloatArray:
    texts = row.get(side, "").split()
    values = [read(text) for text in texts]
    if None in values:
        kept = [text for text, value in zip(texts, values, strict=True) if value is not None]
        findings.repaired("number.not_finite", row, f"{side} contains no number", "left out")
        row.set(side, " ".join(kept))
    return np.array([value for value in values if value is not None], dtype=np.float64)


def _plan_view(junction: Element, findings: Findings) -> PlanView | None:
    element = junction.find("planView")
    if element is None:
        return None
    try:
        plan_view = read_plan_view(element, findings)
        length = float((plan_view.s + plan_view.length).max())
        if length > FARTHEST:
            raise Unusable(element, "plan_view.endless", f"the junction is {length:g} m long")
        return plan_view
    except Unusable as error:
        text, action = error.message, "plan view of the junction left out"
        findings.repaired(error.kind, error.element, text, action, Severity.ERROR)
        remove(element)
        return None
