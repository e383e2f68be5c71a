"""A mapped street, and a connecting road, as elements of OpenDRIVE."""

from collections.abc import Sequence

import numpy as np
from lxml import etree

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.street_plan import MappedStreet, StreetLane
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.junction_turns import Turn
from envgen_usd.streets.street_sections import MEDIAN, SectionLane, StreetSection

_STEP = 1.0
"""Distance of the corners of a cycle crossing along its road, metres."""
Elevation = Sequence[elements.Width]


def street_element(
    number: str,
    street: MappedStreet,
    curve: RoundedLine,
    sections: Sequence[StreetSection],
    elevation: Elevation,
) -> etree._Element:
    """A street as a road, without its links, objects and signals."""
    profile = max((s for s in sections), key=lambda s: s.length).profile
    element = elements.road(number, curve.length, "-1", profile.speed)
    element.set("name", street.name or f"{profile.kind} {number}")
    kind = element.find("type")
    assert kind is not None
    kind.set("type", _type(profile.kind))
    elements.add_lines_and_arcs(element, curve)
    elements.add_profile(element, "elevationProfile", "elevation", elevation)
    for section in sections:
        pieces = elements.smooth_steps(section.offset)
        elements.add_profile(
            element,
            "lanes",
            "laneOffset",
            [(section.start + s, a, b, c, d) for s, a, b, c, d in pieces],
        )
    for section in sections:
        _add_section(element, section)
    return element


def _type(kind: str) -> str:
    """Type of a road by the value of ``highway``."""
    if kind.startswith("motorway"):
        return "motorway"
    return {"trunk": "rural", "living_street": "lowSpeed"}.get(kind, "town")


def _add_section(element: etree._Element, section: StreetSection) -> None:
    profile = section.profile
    both = profile.driving("left") and profile.driving("right")
    many = profile.driving("left") + profile.driving("right") > 2
    has_line = both and profile.lined and profile.marked
    parted = any(lane.lane.kind == MEDIAN for lane in section.left)
    centre = ("solid" if many or parted else "broken") if has_line else "none"
    if not both and any(lane.lane.kind == "shoulder" for lane in section.left):
        centre = "solid" if profile.marked else "none"
    lanes = elements.add_lane_section(element, centre, section.start)
    left = etree.Element("left")
    added = [_add_lane(left, lane, section.left, section) for lane in section.left]
    left.extend(reversed(added))
    if added:
        lanes.insert(0, left)
    if section.right:
        right = etree.SubElement(lanes, "right")
        for lane in section.right:
            _add_lane(right, lane, section.right, section)


def _add_lane(
    side: etree._Element,
    lane: SectionLane,
    beside: Sequence[SectionLane],
    section: StreetSection,
) -> etree._Element:
    element = elements.add_lane(
        side,
        lane.number,
        lane.lane.kind,
        elements.smooth_steps(lane.width),
        _mark(lane, beside, section.profile.lined) if section.profile.marked else "none",
        lane.lane.raised,
    )
    if section.profile.shared and lane.lane.kind == "driving":
        element.set("direction", "both")
    elements.add_lane_links(element, lane.before, lane.after)
    return element


def _mark(lane: SectionLane, beside: Sequence[SectionLane], lined: bool) -> str:
    """Line at the outer border of a lane; `lined` where lines part the directions."""
    after = next((x for x in beside if abs(x.number) == abs(lane.number) + 1), None)
    if lane.lane.kind == "driving":
        if after is None:
            return "solid" if len(beside) > 1 else "none"
        if after.lane.kind == "driving":
            return _between(lane.lane, after.lane)
        return {"biking": "solid", "shoulder": "solid"}.get(
            "" if after.lane.raised else after.lane.kind, "none"
        )
    if lane.lane.kind == MEDIAN:
        return "solid" if lined else "none"
    parks = after is not None and after.lane.kind == "parking"
    return "broken" if lane.lane.kind == "biking" and not lane.lane.raised and parks else "none"


def _between(inner: StreetLane, outer: StreetLane) -> str:
    """Line between two driving lanes; solid on the side of the lane that may not change."""
    lines = ["right" in inner.stays, "left" in outer.stays]
    names = ["solid" if kept else "broken" for kept in lines]
    return names[0] if lines[0] == lines[1] else " ".join(names)


def turn_element(number: str, junction: str, turn: Turn, elevation: Elevation) -> etree._Element:
    """A connecting road with its lanes right of their middle."""
    speed = min(mouth.section.profile.speed for mouth in (turn.incoming, turn.outgoing))
    road = elements.road(number, turn.length, junction, speed)
    for end, mouth in (("predecessor", turn.incoming), ("successor", turn.outgoing)):
        contact = "start" if mouth.arm.at_start else "end"
        elements.add_link(road, end, "road", mouth.road, contact)
    elements.add_plan_view(road, turn.line)
    elements.add_profile(road, "elevationProfile", "elevation", elevation)
    if turn.at_kerb and turn.lanes:
        widths = [sum(pair[n].width for pair in turn.lanes) for n in (0, 1)]
        steps = ((0.0, widths[0]), (turn.length, widths[1]))
        elements.add_profile(road, "lanes", "laneOffset", elements.smooth_steps(steps))
    right = etree.SubElement(elements.add_lane_section(road, "none"), "right")
    for n, pair in enumerate(turn.lanes, 1):
        ends = (pair[0].width, pair[1].width)
        # Beside the sidewalk of a corner, tracks stay raised; others go down to cross a street.
        raised = turn.walks is not None and pair[0].raised and pair[1].raised
        _add_turn_lane(right, -n, pair[0].kind, turn.length, ends, turn.middle, raised)
        elements.add_lane_links(right[-1], pair[0].number, pair[1].number)
    if turn.walks is not None:
        first, last = turn.walks
        number_out = -1 - len(turn.lanes)
        _add_turn_lane(right, number_out, "sidewalk", turn.length, (first.width, last.width))
        elements.add_lane_links(right[-1], first.number, last.number)
    cycles = turn.lanes and turn.lanes[-1][0].kind == "biking"
    if cycles and right.find(f"lane[@id='{-len(turn.lanes)}']/height") is None:
        _add_cycle_crossing(road, turn)
    return road


def _add_cycle_crossing(road: etree._Element, turn: Turn) -> None:
    """Paints the borders of the cycle lane across a junction, the outer lane of a turn."""
    s = np.linspace(0.0, turn.length, max(int(np.ceil(turn.length / _STEP)), 1) + 1)
    widths = [
        elements.smooth_values(((0.0, a.width), (turn.length, b.width)), s) for a, b in turn.lanes
    ]
    left = np.zeros(len(s)) - (0.0 if turn.at_kerb else sum(widths[:-1]))
    left = left + (widths[-1] if turn.at_kerb else 0.0)
    # The outer line lies within the lane, beside the kerb.
    right = left - widths[-1] + elements.CYCLE_LINE / 2.0
    borders = np.column_stack([s, left]), np.column_stack([s, right])
    objects = etree.SubElement(road, "objects")
    name = f"cycle_crossing_{road.get('id')}"
    elements.add_dashed_area(objects, name, "cycle crossing", borders)


def _add_turn_lane(  # noqa: PLR0913, PLR0917 - what a lane follows from
    side: etree._Element,
    number: int,
    kind: str,
    length: float,
    widths: tuple[float, float],
    middle: float = 0.0,
    raised: bool = False,
) -> None:
    between = ((0.25 * length, middle), (0.75 * length, middle)) if middle else ()
    steps = ((0.0, widths[0]), *between, (length, widths[1]))
    elements.add_lane(side, number, kind, elements.smooth_steps(steps), "none", raised)


def junction_element(number: str, turns: Sequence[tuple[str, Turn]]) -> etree._Element:
    """A junction with its connections.

    Args:
        number: Its id.
        turns: Id of each connecting road, and the turn.
    """
    junction = etree.Element("junction", id=number, name=f"junction {number}", type="default")
    for n, (road, turn) in enumerate(turns):
        link = etree.SubElement(
            junction, "connection", id=str(n), incomingRoad=turn.incoming.road,
            connectingRoad=road, contactPoint="start",
        )  # fmt: skip
        for k, pair in enumerate(turn.lanes, 1):
            attributes = {"from": str(pair[0].number), "to": str(-k)}
            etree.SubElement(link, "laneLink", attributes)
    return junction
