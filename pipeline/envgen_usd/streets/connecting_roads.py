"""The connecting roads of a junction: who drives from where to where, and sidewalks at corners."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.geometry.hermite_curves import Cubic, turning_cubic
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_network import CrossSection
from envgen_usd.streets.junction_arms import Arm

_STRAIGHT = np.radians(35.0)
"""Turn up to which traffic goes straight on; beyond it turns left or right."""


@dataclass(frozen=True)
class Mouth:
    """The end of a trimmed street at a junction.

    Attributes:
        arm: Which end of which street.
        section: Cross-section of the street.
        place: x and y of its middle, metres.
        direction: Direction in which the street leaves the junction, radians from x.
        parking: The street has parking lanes; their width is 0 at the junction.
        sidewalk: Width of its sidewalks there, metres.
    """

    arm: Arm
    section: CrossSection
    place: FloatArray
    direction: float
    parking: bool
    sidewalk: float

    @property
    def entering(self) -> int:
        """Number of lanes that lead into the junction."""
        return self.section.backward if self.arm.at_start else self.section.forward

    @property
    def leaving(self) -> int:
        """Number of lanes that lead out of it."""
        return self.section.forward if self.arm.at_start else self.section.backward

    @property
    def heading_in(self) -> float:
        """Heading of traffic that enters the junction."""
        return self.direction + np.pi

    def lane(self, number: int, *, entering: bool) -> int:
        """Lane id of the n-th lane from the middle, from 0."""
        left = entering == self.arm.at_start
        return (1 + number) * (1 if left else -1)

    def sidewalk_lane(self, *, entering: bool) -> int:
        """Lane id of the sidewalk beside the lanes that enter, or beside those that leave."""
        driving = self.entering if entering else self.leaving
        return self.lane(driving + self.parking, entering=entering)

    def offset_place(self, lanes: int, *, entering: bool) -> FloatArray:
        """Where the border after a number of lanes meets the end of the street."""
        # Traffic drives on the right: lanes that enter lie left of an arm that leaves.
        side = 1.0 if entering else -1.0
        normal = np.array([-np.sin(self.direction), np.cos(self.direction)])
        place: FloatArray = self.place + side * lanes * self.section.lane_width * normal
        return place


@dataclass(frozen=True, eq=False)
class Connection:
    """A connecting road; its lanes lie right of its line.

    Attributes:
        incoming: The street end it comes from.
        outgoing: The street end it leads to.
        line: Its reference line.
        lanes: Number of driving lanes.
        first: Number of its inner lane among those that enter, and among those that leave.
        sidewalk: A sidewalk lies beside its lanes.
    """

    incoming: Mouth
    outgoing: Mouth
    line: Cubic
    lanes: int
    first: tuple[int, int]
    sidewalk: bool


def connections(mouths: Sequence[Mouth]) -> Iterator[Connection]:
    """All connecting roads of a junction.

    Traffic goes straight on from lane to lane, turns right from the outer lane and left from the
    inner one. The road to the next arm counter-clockwise carries the sidewalk of the corner.

    Args:
        mouths: Street ends of the junction, counter-clockwise.
    """
    for number, incoming in enumerate(mouths):
        for step in range(1, len(mouths)):
            outgoing = mouths[(number + step) % len(mouths)]
            walks = incoming.sidewalk > 0.0 and outgoing.sidewalk > 0.0
            sidewalk = walks and step == 1
            drives = min(incoming.entering, outgoing.leaving) > 0
            if drives or sidewalk:
                yield _connection(incoming, outgoing, sidewalk, drives)


def _connection(incoming: Mouth, outgoing: Mouth, sidewalk: bool, drives: bool) -> Connection:
    turn = (outgoing.direction - incoming.heading_in + np.pi) % (2.0 * np.pi) - np.pi
    lanes = min(incoming.entering, outgoing.leaving)
    first = (0, 0)
    if turn < -_STRAIGHT or not drives:
        lanes = min(lanes, 1)
        first = (incoming.entering - lanes, outgoing.leaving - lanes)
    elif turn > _STRAIGHT and not sidewalk:
        lanes = 1
    elif sidewalk:
        # The sidewalk lies beside the outer lanes.
        first = (incoming.entering - lanes, outgoing.leaving - lanes)
    line = turning_cubic(
        incoming.offset_place(first[0], entering=True),
        incoming.heading_in,
        outgoing.offset_place(first[1], entering=False),
        outgoing.direction,
    )
    return Connection(incoming, outgoing, line, lanes, first, sidewalk)
