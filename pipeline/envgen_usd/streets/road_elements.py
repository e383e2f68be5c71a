"""Elements of OpenDRIVE 1.7 that street networks need."""

from collections.abc import Iterable, Sequence

from lxml import etree

from envgen_usd.geometry.hermite_curves import Cubic

KERB = 0.12
"""Height of a sidewalk above the carriageway, metres."""
_MARK = 0.12
"""Width of a painted line, metres."""
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


def add_lane_section(element: etree._Element, centre_mark: str) -> etree._Element:
    """The only lane section, with its centre lane."""
    section = etree.SubElement(etree.SubElement(element, "lanes"), "laneSection", s="0")
    centre = etree.SubElement(section, "center")
    _add_mark(etree.SubElement(centre, "lane", id="0", type="none", level="false"), centre_mark)
    return section


def add_lane(
    side: etree._Element, number: int, kind: str, widths: Sequence[Width], mark: str
) -> etree._Element:
    """A lane; sidewalks are raised by a kerb."""
    lane = etree.SubElement(side, "lane", id=str(number), type=kind, level="false")
    for width in widths:
        values = dict(zip(("sOffset", *"abcd"), map(text, width), strict=True))
        etree.SubElement(lane, "width", values)
    _add_mark(lane, mark)
    if kind == "sidewalk":
        etree.SubElement(lane, "height", sOffset="0", inner=text(KERB), outer=text(KERB))
    return lane


def add_lane_links(lane: etree._Element, before: int, after: int) -> None:
    """The lanes that lead into a lane and on from it."""
    link = etree.Element("link")
    etree.SubElement(link, "predecessor", id=str(before))
    etree.SubElement(link, "successor", id=str(after))
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


def add_signal(  # noqa: PLR0913, PLR0917 - what the standard asks of a signal
    signals: etree._Element, name: str, kind: str, s: float, t: float, orientation: str
) -> None:
    """A sign of the German catalogue (StVO), or a traffic light (1000001)."""
    light = kind == "1000001"
    etree.SubElement(
        signals, "signal", id=name, s=text(s), t=text(t), zOffset="2.4" if light else "2.0",
        name="traffic light" if light else f"sign {kind}", dynamic="yes" if light else "no",
        orientation=orientation, country="OpenDRIVE" if light else "DE", type=kind, subtype="-1",
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
