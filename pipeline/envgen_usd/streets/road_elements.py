"""Elements of OpenDRIVE 1.7 that street networks need."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from lxml import etree

from envgen_usd.geometry.hermite_curves import Cubic
from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.array_types import FloatArray

KERB = 0.12
"""Height of a sidewalk above the carriageway, metres."""
_MARK = 0.12
"""Width of a painted line, metres."""
CYCLE_LINE = 0.25
"""Width of the broken lines along the ways of bicycles across junctions, metres (RMS-1)."""
Width = tuple[float, float, float, float, float]
"""sOffset and the coefficients a, b, c, d of a width, metres."""


def road(number: str, length: float, junction: str, speed: int) -> etree._Element:
    """A road without its content; `junction` is -1 for a street."""
    element = etree.Element(
        "road", name=number, length=text(length), id=number, junction=junction, rule="RHT"
    )
    etree.SubElement(element, "link")
    kind = etree.SubElement(element, "type", s="0", type="town")
    etree.SubElement(kind, "speed", max=str(speed), unit="km/h")
    return element


def add_link(element: etree._Element, end: str, kind: str, number: str, contact: str = "") -> None:
    """What follows at an end (``predecessor``, ``successor``): a ``road`` or a ``junction``."""
    attributes = {"elementType": kind, "elementId": number}
    if contact:
        attributes["contactPoint"] = contact
    link = element.find("link")
    assert link is not None
    etree.SubElement(link, end, attributes)


def add_plan_view(element: etree._Element, pieces: Iterable[Cubic]) -> None:
    """The reference line; straight pieces become lines."""
    view, s = etree.SubElement(element, "planView"), 0.0
    for piece in pieces:
        x, y = piece.start
        geometry = etree.SubElement(
            view, "geometry", s=text(s), x=text(x), y=text(y), hdg=text(piece.heading),
            length=text(piece.length),
        )  # fmt: skip
        if piece.straight:
            etree.SubElement(geometry, "line")
        else:
            names = [f"{letter}{axis}" for axis in "UV" for letter in "abcd"]
            values = (0.0, *piece.along, 0.0, *piece.across)
            numbers = dict(zip(names, map(text, values), strict=True))
            etree.SubElement(geometry, "paramPoly3", numbers, pRange="normalized")
        s += piece.length


def add_lines_and_arcs(element: etree._Element, line: RoundedLine) -> None:
    """The reference line of lines and arcs."""
    view = etree.SubElement(element, "planView")
    ends = [*line.s[1:].tolist(), line.length]
    for s, place, heading, curvature, end in zip(
        line.s.tolist(), line.start, line.heading, line.curvature, ends, strict=True
    ):
        geometry = etree.SubElement(
            view, "geometry", s=text(s), x=text(place[0]), y=text(place[1]), hdg=text(heading),
            length=text(end - s),
        )  # fmt: skip
        if curvature:
            etree.SubElement(geometry, "arc", curvature=text(curvature))
        else:
            etree.SubElement(geometry, "line")


def smooth_steps(steps: Sequence[tuple[float, float]]) -> list[Width]:
    """Cubics that go over from each value to the next with level ends."""
    pieces: list[Width] = []
    for (s, value), (end, after) in pairwise(steps):
        length, change = end - s, after - value
        if length < 1e-6:
            continue
        square, cube = 3.0 * change / length**2, -2.0 * change / length**3
        if pieces and not change and pieces[-1][1:] == (value, 0.0, 0.0, 0.0):
            continue
        pieces.append((s, value, 0.0, square, cube) if change else (s, value, 0.0, 0.0, 0.0))
    return pieces


def smooth_values(steps: Sequence[tuple[float, float]], at: FloatArray) -> FloatArray:
    """Values of the cubics of `smooth_steps` at distances, N."""
    pieces = smooth_steps(steps)
    n = np.clip(np.searchsorted([piece[0] for piece in pieces], at, "right") - 1, 0, None)
    s, a, b, c, d = np.array(pieces)[n].T
    x = at - s
    values: FloatArray = a + x * (b + x * (c + x * d))
    return values


def add_profile(element: etree._Element, kind: str, name: str, pieces: Iterable[Width]) -> None:
    """An ``elevationProfile`` with ``elevation``, or ``lanes`` with ``laneOffset``."""
    holder = element.find(kind)
    if holder is None:
        holder = etree.SubElement(element, kind)
    for piece in pieces:
        etree.SubElement(holder, name, dict(zip("sabcd", map(text, piece), strict=True)))


def add_lane_section(
    element: etree._Element, centre_mark: str, start: float = 0.0
) -> etree._Element:
    """A lane section with its centre lane."""
    lanes = element.find("lanes")
    if lanes is None:
        lanes = etree.SubElement(element, "lanes")
    section = etree.SubElement(lanes, "laneSection", s=text(start))
    centre = etree.SubElement(section, "center")
    _add_mark(etree.SubElement(centre, "lane", id="0", type="none", level="false"), centre_mark)
    return section


def add_lane(  # noqa: PLR0913, PLR0917 - what the standard asks of a lane
    side: etree._Element,
    number: int,
    kind: str,
    widths: Sequence[Width],
    mark: str,
    raised: bool = False,
) -> etree._Element:
    """A lane; sidewalks, and other raised lanes, are higher by a kerb."""
    lane = etree.SubElement(side, "lane", id=str(number), type=kind, level="false")
    for width in widths:
        values = dict(zip(("sOffset", *"abcd"), map(text, width), strict=True))
        etree.SubElement(lane, "width", values)
    _add_mark(lane, mark)
    if kind == "sidewalk" or raised:
        etree.SubElement(lane, "height", sOffset="0", inner=text(KERB), outer=text(KERB))
    return lane


def add_lane_links(lane: etree._Element, before: int | None, after: int | None) -> None:
    """The lanes that lead into a lane and on from it; `None`: none."""
    link = etree.Element("link")
    for name, number in (("predecessor", before), ("successor", after)):
        if number is not None:
            etree.SubElement(link, name, id=str(number))
    if len(link):
        lane.insert(0, link)


def add_crosswalk(objects: etree._Element, name: str, s: float, left: float, right: float) -> None:
    """A zebra crossing of 3 m over a carriageway that reaches `left` and `right` of the middle."""
    crosswalk = etree.SubElement(
        objects, "object", id=name, type="crosswalk", s=text(s), t="0", zOffset="0", hdg="0",
        orientation="none",
    )  # fmt: skip
    outlines = etree.SubElement(crosswalk, "outlines")
    outline = etree.SubElement(outlines, "outline", id="0", closed="true")
    for u, v in ((-1.5, -right), (1.5, -right), (1.5, left), (-1.5, left)):
        etree.SubElement(outline, "cornerLocal", u=text(u), v=text(v), z="0", height="0")


def add_road_outline(element: etree._Element, corners: FloatArray) -> None:
    """The closed outline of an object: s, t and height above the road of its corners, N x 3."""
    outlines = etree.SubElement(element, "outlines")
    outline = etree.SubElement(outlines, "outline", id="0", closed="true")
    for number, (s, t, height) in enumerate(corners.tolist()):
        etree.SubElement(
            outline, "cornerRoad", id=str(number), s=text(s), t=text(t), dz="0",
            height=text(height),
        )  # fmt: skip


def add_dashed_area(
    objects: etree._Element, name: str, kind: str, borders: tuple[FloatArray, FloatArray]
) -> None:
    """An area of a road with broken lines along its left and its right border.

    Dashes of 0.5 m with gaps of 0.25 m mark the ways of bicycles across junctions (RMS-1).

    Args:
        objects: Objects of the road.
        name: Id of the area.
        kind: Its name.
        borders: s and t of the left and of the right border, N x 2 each, metres.
    """
    left, right = borders
    middle = (left.mean(0) + right.mean(0)) / 2.0
    area = etree.SubElement(
        objects, "object", id=name, name=kind, type="roadMark", s=text(middle[0]),
        t=text(middle[1]), zOffset="0", hdg="0", orientation="none",
    )  # fmt: skip
    ring = np.concatenate([left, right[::-1]])
    add_road_outline(area, np.column_stack([ring, np.zeros(len(ring))]))
    markings = etree.SubElement(area, "markings")
    for first in (0, len(left)):
        marking = etree.SubElement(
            markings, "marking", color="white", width=text(CYCLE_LINE), lineLength="0.5",
            spaceLength="0.25", startOffset="0", stopOffset="0", zOffset="0.005",
        )  # fmt: skip
        for number in range(first, first + len(left)):
            etree.SubElement(marking, "cornerReference", id=str(number))


def add_painted_line(
    objects: etree._Element, name: str, kind: str, s: float, borders: tuple[float, float]
) -> None:
    """A painted line of 0.5 m across the road between two borders, t in metres."""
    low, high = sorted(borders)
    line = etree.SubElement(
        objects, "object", id=name, name=kind, type="roadMark", s=text(s),
        t=text((low + high) / 2.0), zOffset="0", hdg="0", orientation="none", length="0.5",
        width=text(high - low),
    )  # fmt: skip
    outlines = etree.SubElement(line, "outlines")
    outline = etree.SubElement(outlines, "outline", id="0", closed="true")
    half = (high - low) / 2.0
    for u, v in ((-0.25, -half), (0.25, -half), (0.25, half), (-0.25, half)):
        etree.SubElement(outline, "cornerLocal", u=text(u), v=text(v), z="0", height="0")


def add_arrow(  # noqa: PLR0913, PLR0917 - what the standard asks of an object
    objects: etree._Element,
    name: str,
    kind: str,
    place: tuple[float, float],
    heading: float,
    size: tuple[float, float],
) -> None:
    """A painted arrow: s and t of its middle, heading, and length and width in metres."""
    etree.SubElement(
        objects, "object", id=name, name=kind, type="roadMark", s=text(place[0]),
        t=text(place[1]), zOffset="0", hdg=text(heading), orientation="none",
        length=text(size[0]), width=text(size[1]),
    )  # fmt: skip


def add_standing(
    objects: etree._Element, name: str, kind: tuple[str, str], place: tuple[float, float]
) -> None:
    """An upright object: type and name of its kind, s and t of its place."""
    etree.SubElement(
        objects, "object", id=name, type=kind[0], name=kind[1], s=text(place[0]),
        t=text(place[1]), zOffset="0", hdg="0", orientation="none",
    )  # fmt: skip


def add_signal(  # noqa: PLR0913, PLR0917 - what the standard asks of a signal
    signals: etree._Element,
    name: str,
    kind: str,
    s: float,
    t: float,
    orientation: str,
    *,
    country: str = "DE",
) -> None:
    """A sign of a country's catalogue, the German one (StVO) as a rule, or a traffic light."""
    light = kind == "1000001"
    etree.SubElement(
        signals, "signal", id=name, s=text(s), t=text(t), zOffset="2.4" if light else "2.0",
        name="traffic light" if light else f"sign {kind}", dynamic="yes" if light else "no",
        orientation=orientation, country="OpenDRIVE" if light else country, type=kind, subtype="-1",
        hOffset="0", height="0.9" if light else "0.6", width="0.4" if light else "0.6",
    )  # fmt: skip


def text(value: float) -> str:
    """A number with 12 digits, which holds a tenth of a micrometre over 100 km."""
    return f"{value:.12g}"


def _add_mark(lane: etree._Element, kind: str) -> None:
    etree.SubElement(
        lane, "roadMark", sOffset="0", type=kind, weight="standard", color="standard",
        width=text(_MARK),
    )  # fmt: skip
