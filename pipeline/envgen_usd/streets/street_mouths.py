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
    """A lane for vehicles or bicycles at a junction.

    Attributes:
        number: Lane id.
        inner: Where its left border, as its traffic sees it, meets the junction.
        outer: The same of its right border.
        width: Metres.
        turns: Directions painted on it.
        kind: ``driving`` or ``biking``.
        raised: True for a cycle track as high as the sidewalk.
    """

    number: int
    inner: FloatArray
    outer: FloatArray
    width: float
    turns: frozenset[str]
    kind: str = "driving"
    raised: bool = False


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
        cycling: Cycle lane or track beside the lanes that enter, and beside those that leave, or
            `None`.
        t: Of its place, from the road's reference line to the left, metres.
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
    cycling: tuple[LaneEnd | None, LaneEnd | None] = (None, None)
    t: float = 0.0

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
    left = _Side.of(section.left, place + middle * normal, normal, last)
    right = _Side.of(section.right, place + middle * normal, -normal, last)
    # Traffic keeps right: what enters at the start of a road lies left of its line.
    enters, leaves = (left, right) if arm.at_start else (right, left)
    shared = section.profile.shared
    return StreetMouth(
        arm,
        road,
        (left.kerb() + right.kerb()) / 2.0,
        heading if arm.at_start else heading + np.pi,
        enters.driving(against=False) or (leaves.driving(against=True) if shared else ()),
        leaves.driving(against=False) or (enters.driving(against=True) if shared else ()),
        (enters.walk(), leaves.walk()),
        (enters.kerb(), leaves.kerb()),
        section,
        height,
        (enters.cycling(), leaves.cycling()),
        float(((left.kerb() + right.kerb()) / 2.0 - place) @ normal),
    )


@dataclass(frozen=True, eq=False)
class _Side:
    """The lanes of one side at the end of a section.

    Attributes:
        lanes: From the middle outwards.
        widths: Widths there, metres.
        borders: L + 1 x 2, from the middle outwards, metres.
    """

    lanes: Sequence[SectionLane]
    widths: Sequence[float]
    borders: FloatArray

    @staticmethod
    def of(
        lanes: Sequence[SectionLane], middle: FloatArray, outwards: FloatArray, last: int
    ) -> "_Side":
        """The lanes of a side; `last` is the index of their widths."""
        widths = [lane.width[last][1] for lane in lanes]
        away = np.append(0.0, np.cumsum(widths))
        return _Side(lanes, widths, middle + away[:, None] * outwards)

    def driving(self, *, against: bool) -> tuple[LaneEnd, ...]:
        """The driving lanes; with swapped borders for traffic against their direction."""
        found = []
        for n, lane in enumerate(self.lanes):
            if lane.lane.kind == "driving":
                inner, outer = self.borders[n : n + 2]
                ends = (outer, inner) if against else (inner, outer)
                found.append(LaneEnd(lane.number, *ends, self.widths[n], lane.lane.turns))
        return tuple(found)

    def cycling(self) -> LaneEnd | None:
        """The cycle lane on the carriageway, or the cycle track beside it."""
        for n, lane in enumerate(self.lanes):
            if lane.lane.kind == "biking":
                inner, outer = self.borders[n : n + 2]
                width, raised = self.widths[n], lane.lane.raised
                return LaneEnd(lane.number, inner, outer, width, frozenset(), "biking", raised)
        return None

    def kerb(self) -> FloatArray:
        """Outer border of the carriageway."""
        on_road = [lane.lane.kind in CARRIAGEWAY and not lane.lane.raised for lane in self.lanes]
        outermost = max((n + 1 for n, is_on in enumerate(on_road) if is_on), default=0)
        kerb: FloatArray = self.borders[outermost]
        return kerb

    def walk(self) -> Walk | None:
        """The innermost sidewalk."""
        for n, lane in enumerate(self.lanes):
            if lane.lane.kind == "sidewalk":
                return Walk(lane.number, self.borders[n], self.widths[n])
        return None
