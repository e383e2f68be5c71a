"""The ends of mapped streets at junctions: where lanes and kerbs meet them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_plan import CARRIAGEWAY
from envgen_usd.streets.junction_clusters import ArmEnd
from envgen_usd.streets.street_sections import SectionLane, StreetSection


@dataclass(frozen=True, eq=False)
class LaneEnd:
    """A driving lane at a junction.

    Attributes:
        number: Lane id.
        inner: Where its left border, as its traffic sees it, meets the junction.
        outer: The same of its right border.
        width: Metres.
        turns: Directions painted on it.
    """

    number: int
    inner: FloatArray
    outer: FloatArray
    width: float
    turns: frozenset[str]


@dataclass(frozen=True, eq=False)
class Walk:
    """A sidewalk at a junction.

    Attributes:
        number: Lane id.
        kerb: Where its inner border meets the junction.
        width: Metres.
    """

    number: int
    kerb: FloatArray
    width: float


@dataclass(frozen=True, eq=False)
class StreetMouth:
    """An end of a street at a junction.

    Attributes:
        arm: Which end of which street.
        road: Id of its road.
        place: Middle of its carriageway.
        direction: Direction in which the street leaves the junction, radians.
        entering: Lanes that lead into the junction, from the middle outwards.
        leaving: Lanes that lead out of it, from the middle outwards.
        walks: Sidewalk beside the lanes that enter, and beside those that leave, or `None`.
        kerbs: Where the kerb beside the lanes that enter, and beside those that leave, meets it.
        section: The section that ends here.
        height: Height and slope outwards; metres and its derivative.
    """

    arm: ArmEnd
    road: str
    place: FloatArray
    direction: float
    entering: tuple[LaneEnd, ...]
    leaving: tuple[LaneEnd, ...]
    walks: tuple[Walk | None, Walk | None]
    kerbs: tuple[FloatArray, FloatArray]
    section: StreetSection
    height: tuple[float, float] = (0.0, 0.0)

    @property
    def heading_in(self) -> float:
        """Heading of traffic that enters the junction."""
        return self.direction + np.pi


def street_mouth(
    arm: ArmEnd,
    road: str,
    curve: RoundedLine,
    sections: Sequence[StreetSection],
    height: tuple[float, float] = (0.0, 0.0),
) -> StreetMouth:
    """An end of a road, exactly as the file says it.

    Args:
        arm: Which end of which street.
        road: Id of the road.
        curve: Its reference line between junctions.
        sections: Its lane sections.
        height: Height there, and slope outwards.
    """
    section, last = (sections[0], 0) if arm.at_start else (sections[-1], -1)
    places, headings = curve(np.array([0.0 if arm.at_start else curve.length]))
    place, heading = places[0], float(headings[0])
    normal = np.array([-np.sin(heading), np.cos(heading)])
    middle = section.offset[last][1]
    sides = {
        "left": _borders(section.left, middle, 1.0, last),
        "right": _borders(section.right, middle, -1.0, last),
    }

    def at(t: float) -> FloatArray:
        point: FloatArray = place + t * normal
        return point

    def driving(side: str, *, against: bool) -> tuple[LaneEnd, ...]:
        lanes: tuple[SectionLane, ...] = getattr(section, side)
        found = []
        for n, lane in enumerate(lanes):
            if lane.lane.kind == "driving":
                inner, outer = at(sides[side][n]), at(sides[side][n + 1])
                ends = (outer, inner) if against else (inner, outer)
                found.append(LaneEnd(lane.number, *ends, lane.width[last][1], lane.lane.turns))
        return tuple(found)

    def kerb(side: str) -> int:
        lanes: tuple[SectionLane, ...] = getattr(section, side)
        inside = [
            n
            for n, lane in enumerate(lanes)
            if lane.lane.kind in CARRIAGEWAY and not lane.lane.raised
        ]
        return inside[-1] + 1 if inside else 0

    def walk(side: str) -> Walk | None:
        lanes: tuple[SectionLane, ...] = getattr(section, side)
        for n, lane in enumerate(lanes):
            if lane.lane.kind == "sidewalk":
                width = lane.width[last][1]
                return Walk(lane.number, at(sides[side][n]), width)
        return None

    # Traffic keeps right: what enters at the start of a road lies left of its line.
    enters, leaves = ("left", "right") if arm.at_start else ("right", "left")
    shared = section.profile.shared
    entering = driving(enters, against=False) or (driving(leaves, against=True) if shared else ())
    leaving = driving(leaves, against=False) or (driving(enters, against=True) if shared else ())
    return StreetMouth(
        arm,
        road,
        at((sides["left"][kerb("left")] + sides["right"][kerb("right")]) / 2.0),
        heading if arm.at_start else heading + np.pi,
        entering,
        leaving,
        (walk(enters), walk(leaves)),
        (at(sides[enters][kerb(enters)]), at(sides[leaves][kerb(leaves)])),
        section,
        height,
    )


def _borders(lanes: Sequence[SectionLane], middle: float, sign: float, last: int) -> list[float]:
    """T of the borders of lanes from the middle outwards, metres."""
    widths = [lane.width[last][1] for lane in lanes]
    borders: list[float] = (middle + sign * np.append(0.0, np.cumsum(widths))).tolist()
    return borders
