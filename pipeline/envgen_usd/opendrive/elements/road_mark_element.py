"""Reads road marks of a lane (11.9)."""

from collections.abc import Iterable, Iterator

from envgen_usd.errors import Severity
from envgen_usd.models.cubics import NO_CUBICS
from envgen_usd.models.road_marks import RoadMark, RoadMarkLine
from envgen_usd.opendrive.document.findings import Element, Findings, remove
from envgen_usd.opendrive.document.number_attributes import number
from envgen_usd.opendrive.elements.cubic_elements import read_cubics

NO_WIDTH = -1.0
"""Width of a mark without a width in the file."""
NARROWEST, WIDEST = 0.03, 1.0
"""Bounds in metres on the width of a mark; the environment decides instead of others."""
FARTHEST = 100.0
"""Largest distance in metres of a line from the border that it marks."""
SHORTEST_PERIOD = 0.2
"""Shortest period of dash and gap in metres; shorter periods become a solid line."""


def read_marks(elements: Iterable[Element], findings: Findings) -> tuple[RoadMark, ...]:
    """Reads the marks of a lane, sorted by sOffset."""
    marks = [_mark(element, findings) for element in elements]
    if len(marks) > 1:
        marks.sort(key=lambda mark: mark.s_offset)
    return tuple(marks)


def _mark(element: Element, findings: Findings) -> RoadMark:
    get = element.get
    lines: tuple[RoadMarkLine, ...] = ()
    explicit: tuple[RoadMarkLine, ...] = ()
    sway = NO_CUBICS
    if len(element):
        kind = element.find("type")
        if kind is not None:
            width = _width(kind, findings, NO_WIDTH)
            lines = tuple(_lines(kind, width, findings))
        exact = element.find("explicit")
        if exact is not None:
            explicit = tuple(_lines(exact, 0.0, findings))
        sway = read_cubics(list(element.iterchildren("sway")), "ds", findings)
    return RoadMark(
        _offset(element, findings),
        get("type", "none"),
        get("weight", "standard"),
        get("color", "standard"),
        _width(element, findings, NO_WIDTH),
        number(element, "height", findings),
        get("laneChange", ""),
        get("material", ""),
        lines,
        explicit,
        sway,
    )


def _width(element: Element, findings: Findings, otherwise: float) -> float:
    """Reads the width of a line or mark in metres; `otherwise` stands for a missing width."""
    width = number(element, "width", findings, otherwise)
    if width <= 0 or NARROWEST <= width <= WIDEST or element.get("width") is None:
        return width
    text = f"width={width:g} is not from {NARROWEST:g} to {WIDEST:g} m"
    findings.repaired("road_mark.width", element, text, "treated as a mark without a width")
    del element.attrib["width"]
    return otherwise


def _lines(element: Element, width: float, findings: Findings) -> Iterator[RoadMarkLine]:
    """Reads lines; those far from the border would lead across the map."""
    for each in list(element.iterchildren("line")):
        line = _line(each, width, findings)
        if abs(line.t_offset) <= FARTHEST:
            yield line
            continue
        text = f"tOffset={line.t_offset:g} is more than {FARTHEST:g} m from the border"
        findings.repaired("number.beyond_bounds", each, text, "left out", Severity.ERROR)
        remove(each)


def _line(element: Element, width: float, findings: Findings) -> RoadMarkLine:
    length, space = number(element, "length", findings), number(element, "space", findings)
    period = length + space
    if element.get("space") is not None and space > 0 and period < SHORTEST_PERIOD:
        text = f"a dash every {period:g} m"
        findings.repaired("road_mark.dense", element, text, "treated as a solid line")
        length, space = 1.0, 0.0
        element.set("length", "1.0")
        element.set("space", "0.0")
    return RoadMarkLine(
        length,
        space,
        number(element, "tOffset", findings),
        _offset(element, findings),
        _width(element, findings, width),
        element.get("rule", ""),
        element.get("color", ""),
    )


def _offset(element: Element, findings: Findings) -> float:
    offset = number(element, "sOffset", findings)
    if offset < 0:
        text = f"sOffset={offset!r} is below 0"
        findings.repaired("number.negative_start", element, text, "moved to 0", Severity.INFO)
        element.set("sOffset", "0.0")
        return 0.0
    return offset
