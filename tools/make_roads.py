"""Writes the project's own roads, `asset_library/roads/{straight,town}.xodr`.

Run from anywhere: ``python tools/make_roads.py``. Both are plain ASAM OpenDRIVE 1.7.
"""

from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

FOLDER = Path(__file__).resolve().parents[1] / "asset_library" / "roads"
LANE, SIDEWALK, KERB = 3.5, 2.0, 0.12
REACH = 14.0
"""Distance from a junction's centre to its arms, and radius of its turns, metres."""


@dataclass
class Pen:
    """Draws a reference line piece by piece."""

    x: float
    y: float
    heading: float
    s: float = 0.0
    pieces: list[ET.Element] = field(default_factory=list)

    def draw(self, length: float, start: float = 0.0, end: float | None = None) -> "Pen":
        """Adds a line, arc or spiral by its curvature (1/m) at start and end."""
        end = start if end is None else end
        at = {"s": self.s, "x": self.x, "y": self.y, "hdg": self.heading, "length": length}
        piece = ET.Element("geometry", {name: f"{value:.12g}" for name, value in at.items()})
        if start == end == 0.0:
            ET.SubElement(piece, "line")
        elif start == end:
            ET.SubElement(piece, "arc", curvature=f"{start:.12g}")
        else:
            ET.SubElement(piece, "spiral", curvStart=f"{start:.12g}", curvEnd=f"{end:.12g}")
        self.pieces.append(piece)
        self._advance(length, start, end)
        return self

    def _advance(self, length: float, start: float, end: float) -> None:
        nodes, weights = np.polynomial.legendre.leggauss(32)
        u = length * (nodes + 1) / 2
        heading = self.heading + start * u + (end - start) * u**2 / (2 * length)
        self.x += float(length / 2 * weights @ np.cos(heading))
        self.y += float(length / 2 * weights @ np.sin(heading))
        self.heading += (start + end) / 2 * length
        self.s += length


def add_link(parent: ET.Element, tag: str, target: tuple[str, str, str] | None) -> None:
    """Adds a road's predecessor or successor (element, id, contact point)."""
    if target:
        attributes = {"elementType": target[0], "elementId": target[1]}
        if target[2]:
            attributes["contactPoint"] = target[2]
        ET.SubElement(parent, tag, attributes)


@dataclass
class LaneSpec:
    """A lane of constant width and height."""

    id: int
    type: str
    width: float
    mark: str
    height: float = 0.0


def add_lane(parent: ET.Element, lane: LaneSpec, link: tuple[int, int] | None) -> None:
    """Adds a lane; link holds the lanes of the predecessor and of the successor."""
    element = ET.SubElement(parent, "lane", id=str(lane.id), type=lane.type, level="false")
    if link:
        links = ET.SubElement(element, "link")
        ET.SubElement(links, "predecessor", id=str(link[0]))
        ET.SubElement(links, "successor", id=str(link[1]))
    if lane.id:
        ET.SubElement(element, "width", sOffset="0", a=f"{lane.width:g}", b="0", c="0", d="0")
    style = {"sOffset": "0", "type": lane.mark, "weight": "standard", "color": "standard"}
    if lane.mark != "none":
        style |= {"width": "0.12"}
    ET.SubElement(element, "roadMark", style)
    if lane.height:
        height = f"{lane.height:g}"
        ET.SubElement(element, "height", sOffset="0", inner=height, outer=height)


def make_road(  # noqa: PLR0913 - one argument for each part of a road
    road: str,
    pen: Pen,
    *,
    junction: str = "-1",
    ends: tuple[tuple[str, str, str] | None, tuple[str, str, str] | None] = (None, None),
    elevation: tuple[tuple[float, ...], ...] = ((0, 0, 0, 0, 0),),
    sides: tuple[str, ...] = ("left", "right"),
    sidewalk: bool = True,
) -> ET.Element:
    """Makes a road of one lane section: a driving lane and a raised sidewalk on each side."""
    element = ET.Element(
        "road", name=road, length=f"{pen.s:.12g}", id=road, junction=junction, rule="RHT"
    )
    link = ET.SubElement(element, "link")
    add_link(link, "predecessor", ends[0])
    add_link(link, "successor", ends[1])
    kind = ET.SubElement(element, "type", s="0", type="town")
    ET.SubElement(kind, "speed", max="50", unit="km/h")
    ET.SubElement(element, "planView").extend(pen.pieces)
    profile = ET.SubElement(element, "elevationProfile")
    for row in elevation:
        ET.SubElement(
            profile, "elevation", dict(zip("sabcd", (f"{v:.12g}" for v in row), strict=True))
        )
    add_lanes(element, sides, sidewalk, ends if junction != "-1" else None)
    return element


def add_lanes(
    road: ET.Element,
    sides: tuple[str, ...],
    sidewalk: bool,
    through: tuple[tuple[str, str, str] | None, tuple[str, str, str] | None] | None,
) -> None:
    """Adds the lane section; a connecting road goes `through` from an arm to another."""
    section = ET.SubElement(ET.SubElement(road, "lanes"), "laneSection", s="0")
    for side, sign in (("left", 1), ("center", 0), ("right", -1)):
        if side == "center":
            mark = "none" if through else "broken"
            add_lane(ET.SubElement(section, side), LaneSpec(0, "none", 0.0, mark), None)
        elif side in sides:
            group = ET.SubElement(section, side)
            lanes = [LaneSpec(sign, "driving", LANE, "none" if through else "solid")]
            if sidewalk:
                lanes.append(LaneSpec(2 * sign, "sidewalk", SIDEWALK, "none", KERB))
            for lane in sorted(lanes, key=lambda entry: -entry.id):
                add_lane(group, lane, linked_lanes(lane.id, through) if through else None)


def linked_lanes(
    lane: int, ends: tuple[tuple[str, str, str] | None, tuple[str, str, str] | None]
) -> tuple[int, int]:
    """Lanes that a connecting road's lane continues: it leaves one arm and enters another."""
    assert ends[0]
    assert ends[1]
    return (
        lane if ends[0][2] == "end" else -lane,
        lane if ends[1][2] == "start" else -lane,
    )


def add_crosswalk(road: ET.Element, s: float, number: int) -> None:
    """Adds a crosswalk, 3 m wide, over both driving lanes."""
    objects = road.find("objects")
    if objects is None:
        objects = ET.SubElement(road, "objects")
    shape = {"s": f"{s:g}", "t": "0", "zOffset": "0", "hdg": "0", "orientation": "none"}
    walk = ET.SubElement(objects, "object", id=f"cw{number}", type="crosswalk", **shape)
    outlines = ET.SubElement(walk, "outlines")
    outline = ET.SubElement(outlines, "outline", id="0", closed="true")
    for u, v in ((-1.5, -LANE), (1.5, -LANE), (1.5, LANE), (-1.5, LANE)):
        ET.SubElement(outline, "cornerLocal", u=f"{u:g}", v=f"{v:g}", z="0", height="0")


@dataclass
class Arm:
    """An arm of a junction: the road there, which of its ends, and where it points (outwards)."""

    road: str
    contact: str
    direction: float


def make_junction(
    number: str, centre: tuple[float, float], arms: list[Arm], first: int
) -> list[ET.Element]:
    """Makes a junction: its element last, its connecting roads before."""
    junction = ET.Element("junction", id=number, name=f"junction {number}", type="default")
    roads = []
    taken = {round(arm.direction / (np.pi / 2)) % 4 for arm in arms}
    for incoming in arms:
        for outgoing in arms:
            if incoming is outgoing:
                continue
            turn = (outgoing.direction - (incoming.direction + np.pi) + np.pi) % (2 * np.pi) - np.pi
            pen = Pen(
                centre[0] + REACH * np.cos(incoming.direction),
                centre[1] + REACH * np.sin(incoming.direction),
                incoming.direction + np.pi,
            )
            turns = abs(turn) > 0.1
            if turns:
                pen.draw(REACH * np.pi / 2, np.sign(turn) / REACH)
            else:
                pen.draw(2 * REACH)
            on_right = round((incoming.direction + np.pi / 2) / (np.pi / 2)) % 4
            ends = (
                ("road", incoming.road, incoming.contact),
                ("road", outgoing.road, outgoing.contact),
            )
            name = str(first + len(roads))
            roads.append(
                make_road(
                    name,
                    pen,
                    junction=number,
                    ends=ends,
                    sides=("right",),
                    sidewalk=turn < -0.1 or (not turns and on_right not in taken),
                )
            )
            connection = ET.SubElement(
                junction,
                "connection",
                id=str(len(roads) - 1),
                incomingRoad=incoming.road,
                connectingRoad=name,
                contactPoint="start",
            )
            source = -1 if incoming.contact == "end" else 1
            ET.SubElement(connection, "laneLink", {"from": str(source), "to": "-1"})
    return [*roads, junction]


def hill(length: float, height: float, flat: float) -> tuple[tuple[float, ...], ...]:
    """Elevation that is flat at both ends and rises to a smooth top in the middle."""
    half = length / 2 - flat
    c, d = 3 * height / half**2, -2 * height / half**3
    middle = length / 2
    return (
        (0, 0, 0, 0, 0),
        (flat, 0, 0, c, d),
        (middle, height, 0, -c, -d),
        (length - flat, 0, 0, 0, 0),
    )


def make_town() -> list[ET.Element]:
    """Makes a block with a crossing, a T-junction, curves, a hill and roads that lead out."""
    quarter = np.pi / 2
    east = Pen(REACH, 0, 0).draw(220 - 2 * REACH)
    loop = Pen(0, REACH, quarter).draw(136).draw(40 * quarter, -1 / 40).draw(140)
    loop.draw(40 * quarter, -1 / 40).draw(136)
    out = Pen(220 + REACH, 0, 0).draw(30).draw(25, 0, 1 / 45).draw(30, 1 / 45)
    out.draw(25, 1 / 45, 0).draw(60)
    west = Pen(-REACH, 0, np.pi).draw(40).draw(40, 0, -1 / 80).draw(40, -1 / 80, 0).draw(50)
    south = Pen(0, -REACH, -quarter).draw(130)
    a, b = ("junction", "100", ""), ("junction", "200", "")
    roads = [
        make_road("1", east, ends=(a, b)),
        make_road("2", loop, ends=(a, b), elevation=hill(loop.s, 5.0, 20.0)),
        make_road("3", out, ends=(b, None), elevation=((0, 0, 0, 0, 0), (60, 0, 0, 4e-4, 0))),
        make_road("4", west, ends=(a, None)),
        make_road("5", south, ends=(a, None), elevation=((0, 0, 0, 0, 0), (40, 0, 0, -3e-4, 0))),
    ]
    for number, (road, s) in enumerate(((roads[0], 5.0), (roads[0], 187.0), (roads[1], 5.0))):
        add_crosswalk(road, s, number)
    crossing = [
        Arm("1", "start", 0.0),
        Arm("2", "start", quarter),
        Arm("4", "start", np.pi),
        Arm("5", "start", -quarter),
    ]
    tee = [Arm("1", "end", np.pi), Arm("2", "end", quarter), Arm("3", "start", 0.0)]
    return [
        *roads,
        *make_junction("100", (0.0, 0.0), crossing, 1000),
        *make_junction("200", (220.0, 0.0), tee, 2000),
    ]


def make_straight() -> list[ET.Element]:
    """Makes a straight road of 400 m."""
    return [make_road("1", Pen(0, 0, 0).draw(400))]


def write(name: str, elements: list[ET.Element]) -> None:
    """Writes a file, roads before junctions as the schema wants."""
    root = ET.Element("OpenDRIVE")
    ET.SubElement(root, "header", revMajor="1", revMinor="7", name=name, version="1.0")
    root.extend(sorted(elements, key=lambda element: element.tag, reverse=True))
    ET.indent(root)
    ET.ElementTree(root).write(FOLDER / f"{name}.xodr", encoding="UTF-8", xml_declaration=True)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    write("straight", make_straight())
    write("town", make_town())
