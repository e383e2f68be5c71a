"""A street network as OpenDRIVE: roads for streets, junctions with connecting roads at nodes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
import shapely
from lxml import etree
from shapely.ops import substring

from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.hermite_curves import Cubic, smooth_curve
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_network import Street, StreetNetwork
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.connecting_roads import Connection, Mouth, connections
from envgen_usd.streets.junction_arms import Arm, arms_of, trims

_LEAST_LENGTH = 5.0
"""Least length of a street between its junctions, metres."""
_CROSSWALK = 3.0
"""Distance of a zebra crossing's middle from the junction, metres."""
_STOP = 5.0
"""Distance of a stop line from the junction, metres."""
_POST = 0.5
"""Distance of a sign from the kerb, metres."""
_PARKING_FREE = 9.0
"""Length beside a junction without parking, metres; StVO section 12 asks for 5 m and more."""
_PARKING_TAPER = 3.0
"""Length over which a parking lane widens, metres."""
_PARKED_LENGTH = 6.0
"""Least length of a parking lane, metres."""


@dataclass(frozen=True, eq=False)
class _Road:
    """A street as a road.

    Attributes:
        id: Number of the road.
        street: The street.
        curve: Its reference line between its junctions.
    """

    id: str
    street: Street
    curve: tuple[Cubic, ...]

    @property
    def length(self) -> float:
        """Length of the reference line, metres."""
        return sum(piece.length for piece in self.curve)

    @property
    def parks(self) -> bool:
        """True if there is room for parking lanes."""
        free = 2.0 * (_PARKING_FREE + _PARKING_TAPER) + _PARKED_LENGTH
        return self.street.section.parking > 0.0 and self.length > free

    def mouth(self, arm: Arm) -> Mouth:
        """An end of the reference line, exactly as the file says it."""
        section = self.street.section
        sidewalk = section.sidewalk + self.parks * section.parking if section.sidewalk else 0.0
        place, heading = self.curve[0].start, self.curve[0].heading
        if not arm.at_start:
            place, heading = self.curve[-1].end()
            heading += np.pi
        return Mouth(arm, section, place, heading, self.parks, sidewalk)


def network_xml(network: StreetNetwork, name: str) -> bytes:
    """OpenDRIVE 1.7 of a street network, for traffic on the right.

    Args:
        network: The streets; each node with two arms or more becomes a junction.
        name: Name of the map, for the header.

    Raises:
        EnvgenError: Two junctions are so near to one another that no street is left between them.
    """
    root = etree.Element("OpenDRIVE")
    etree.SubElement(root, "header", revMajor="1", revMinor="7", name=name, version="1.0")
    arms = arms_of(network)
    cuts = _cuts(network, arms)
    roads = [
        _Road(str(number + 1), street, tuple(smooth_curve(_between(street, *cuts[number]))))
        for number, street in enumerate(network.streets)
    ]
    root.extend(_street_road(road, arms, network) for road in roads)
    numbers = map(str, count(len(roads) + 1))
    junctions: list[etree._Element] = []
    for node in sorted(node for node, ends in arms.items() if len(ends) > 1):
        mouths = [roads[arm.street].mouth(arm) for arm in arms[node]]
        junction, connecting = _junction(node, mouths, numbers)
        root.extend(connecting)
        junctions.append(junction)
    root.extend(junctions)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _cuts(network: StreetNetwork, arms: Mapping[int, Sequence[Arm]]) -> FloatArray:
    """Length that each street loses at its start and at its end, S x 2."""
    cuts = np.zeros((len(network.streets), 2))
    for ends in arms.values():
        if len(ends) > 1:
            for arm, length in zip(ends, trims(network, ends), strict=True):
                cuts[arm.street, 0 if arm.at_start else 1] = length
    lengths = np.array([shapely.LineString(street.line).length for street in network.streets])
    short = np.flatnonzero(lengths - cuts.sum(1) < _LEAST_LENGTH)
    if len(short):
        x, y = network.streets[short[0]].line.mean(0)
        raise EnvgenError(
            f"street {short[0]} at {x:.0f}, {y:.0f}: is {lengths[short[0]]:.0f} m long, and its"
            f" junctions need {cuts[short[0]].sum():.0f} m; give larger blocks or fewer lanes"
        )
    return cuts


def _between(street: Street, first: float, last: float) -> FloatArray:
    """The middle of a street between its junctions, N x 2."""
    line = shapely.LineString(street.line)
    part = substring(line, first, line.length - last)
    points: FloatArray = shapely.get_coordinates(part)
    return points


def _street_road(
    road: _Road, arms: Mapping[int, Sequence[Arm]], network: StreetNetwork
) -> etree._Element:
    street, section = road.street, road.street.section
    element = elements.road(road.id, road.length, "-1", section.speed)
    for node, end in ((street.start, "predecessor"), (street.end, "successor")):
        if len(arms[node]) > 1:
            elements.add_link(element, end, "junction", _junction_id(node))
    elements.add_plan_view(element, road.curve)
    two_way = section.forward and section.backward
    centre = "solid solid" if section.forward + section.backward > 2 else "broken"
    lanes = elements.add_lane_section(element, centre if two_way else "none")
    left = etree.Element("left")
    left.extend(reversed(_side_lanes(road, section.backward, 1)))
    lanes.insert(0, left)
    etree.SubElement(lanes, "right").extend(_side_lanes(road, section.forward, -1))
    objects = etree.SubElement(element, "objects")
    signals = etree.SubElement(element, "signals")
    if road.length > 4.0 * _STOP:
        for node, at_start in ((street.start, True), (street.end, False)):
            mains = sum(network.streets[arm.street].section.main for arm in arms[node])
            if len(arms[node]) > 2 and mains:
                _add_crosswalk(objects, road, at_start)
                _add_priority(signals, road, at_start, lights=mains > 2)
    return element


def _side_lanes(road: _Road, driving: int, sign: int) -> list[etree._Element]:
    """Lanes of a side from the middle outwards."""
    section, side = road.street.section, etree.Element("side")
    even: list[elements.Width] = [(0.0, section.lane_width, 0.0, 0.0, 0.0)]
    lanes = [("driving", even, "broken" if n + 1 < driving else "none") for n in range(driving)]
    walk: list[elements.Width] = [(0.0, section.sidewalk, 0.0, 0.0, 0.0)]
    if road.parks:
        widths = _parking_widths(section.parking, road.length)
        lanes.append(("parking", widths, "none"))
        whole = section.sidewalk + section.parking
        walk = [(s, whole - a, -b, -c, -d) for s, a, b, c, d in widths]
    if section.sidewalk:
        lanes.append(("sidewalk", walk, "none"))
    for number, lane in enumerate(lanes, 1):
        elements.add_lane(side, sign * number, *lane)
    return list(side)


def _parking_widths(width: float, length: float) -> list[elements.Width]:
    """None beside junctions, and smooth cubics between."""
    square, cube = 3.0 * width / _PARKING_TAPER**2, 2.0 * width / _PARKING_TAPER**3
    end = length - _PARKING_FREE
    return [
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (_PARKING_FREE, 0.0, 0.0, square, -cube),
        (_PARKING_FREE + _PARKING_TAPER, width, 0.0, 0.0, 0.0),
        (end - _PARKING_TAPER, width, 0.0, -square, cube),
        (end, 0.0, 0.0, 0.0, 0.0),
    ]


def _add_crosswalk(objects: etree._Element, road: _Road, at_start: bool) -> None:
    """A zebra crossing over a main street beside a junction."""
    section = road.street.section
    if section.main and section.sidewalk:
        s = _CROSSWALK if at_start else road.length - _CROSSWALK
        name = f"crosswalk_{road.id}_{'start' if at_start else 'end'}"
        elements.add_crosswalk(objects, name, s, section.left, section.right)


def _add_priority(signals: etree._Element, road: _Road, at_start: bool, *, lights: bool) -> None:
    """A traffic light with its stop line, or a sign that gives priority to the main street."""
    section = road.street.section
    if not (section.backward if at_start else section.forward):
        return
    s = _STOP if at_start else road.length - _STOP
    t = section.left + _POST if at_start else -(section.right + _POST)
    end, orientation = ("start", "-") if at_start else ("end", "+")
    kind = "1000001" if lights else "301" if section.main else "205"
    elements.add_signal(signals, f"signal_{road.id}_{end}", kind, s, t, orientation)
    if lights:
        elements.add_signal(signals, f"stop_{road.id}_{end}", "294", s, 0.0, orientation)


def _junction(
    node: int, mouths: Sequence[Mouth], numbers: Iterator[str]
) -> tuple[etree._Element, list[etree._Element]]:
    """A junction and its connecting roads, which take the next numbers."""
    name, roads = _junction_id(node), []
    junction = etree.Element("junction", id=name, name=f"junction {name}", type="default")
    for number, connection in enumerate(connections(mouths)):
        road = _connecting_road(next(numbers), name, connection)
        roads.append(road)
        link = etree.SubElement(
            junction, "connection", id=str(number), contactPoint="start",
            incomingRoad=_road_id(connection.incoming), connectingRoad=road.get("id", ""),
        )  # fmt: skip
        for lane in road.iterfind("lanes/laneSection/right/lane[@type='driving']"):
            before = lane.find("link/predecessor")
            assert before is not None
            attributes = {"from": before.get("id", ""), "to": lane.get("id", "")}
            etree.SubElement(link, "laneLink", attributes)
    return junction, roads


def _connecting_road(number: str, junction: str, connection: Connection) -> etree._Element:
    incoming, outgoing, line = connection.incoming, connection.outgoing, connection.line
    sections = incoming.section, outgoing.section
    speed = min(section.speed for section in sections)
    road = elements.road(number, line.length, junction, speed)
    for end, mouth in (("predecessor", incoming), ("successor", outgoing)):
        contact = "start" if mouth.arm.at_start else "end"
        elements.add_link(road, end, "road", _road_id(mouth), contact)
    elements.add_plan_view(road, [line])
    right = etree.SubElement(elements.add_lane_section(road, "none"), "right")
    lane_widths = (section.lane_width for section in sections)
    width = [_widening(*lane_widths, length=line.length)]
    for n in range(connection.lanes):
        lane = elements.add_lane(right, -1 - n, "driving", width, "none")
        elements.add_lane_links(
            lane,
            incoming.lane(connection.first[0] + n, entering=True),
            outgoing.lane(connection.first[1] + n, entering=False),
        )
    if connection.sidewalk:
        width = [_widening(incoming.sidewalk, outgoing.sidewalk, length=line.length)]
        lane = elements.add_lane(right, -1 - connection.lanes, "sidewalk", width, "none")
        elements.add_lane_links(
            lane, incoming.sidewalk_lane(entering=True), outgoing.sidewalk_lane(entering=False)
        )
    return road


def _widening(first: float, last: float, *, length: float) -> elements.Width:
    """A width that goes over into another one smoothly."""
    change = last - first
    return (0.0, first, 0.0, 3.0 * change / length**2, -2.0 * change / length**3)


def _road_id(mouth: Mouth) -> str:
    return str(mouth.arm.street + 1)


def _junction_id(node: int) -> str:
    return str(node + 1)
