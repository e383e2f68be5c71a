"""Where streets end before a junction, so that its corners are round and no two streets overlap."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_network import StreetNetwork

_CORNER = 6.5
"""Radius of the kerb at a corner, metres; sidewalks are narrower. A larger value makes junctions
larger."""
_LEAST_TRIM = 3.0
"""Least distance from a junction's node to the end of a street, metres."""
_FLAT = np.radians(172.0)
"""Angle between two arms from which they have no corner."""


@dataclass(frozen=True)
class Arm:
    """An end of a street at a node.

    Attributes:
        street: Number of the street.
        at_start: The street begins at the node.
        direction: Direction in which the street leaves the node, radians from x.
    """

    street: int
    at_start: bool
    direction: float


def arms_of(network: StreetNetwork) -> dict[int, list[Arm]]:
    """The ends of streets at each node, counter-clockwise by direction."""
    arms: dict[int, list[Arm]] = defaultdict(list)
    for number, street in enumerate(network.streets):
        for node, at_start, (here, there) in (
            (street.start, True, street.line[:2]),
            (street.end, False, street.line[:-3:-1]),
        ):
            x, y = there - here
            arms[node].append(Arm(number, at_start, float(np.arctan2(y, x))))
    return {node: sorted(ends, key=lambda arm: arm.direction) for node, ends in arms.items()}


def trims(network: StreetNetwork, arms: Sequence[Arm]) -> FloatArray:
    """Length by which each arm of a junction is shorter than its street, metres.

    Two neighbouring kerbs, offset from their streets' middles by a and b and at an angle w, meet
    (b + a cos w) / sin w along the first street; an arc of radius r touches them r / tan(w / 2)
    farther out.

    Args:
        network: The streets.
        arms: Arms of one node, counter-clockwise.
    """
    reach = np.full(len(arms), _LEAST_TRIM)
    for number, arm in enumerate(arms):
        after = (number + 1) % len(arms)
        angle = (arms[after].direction - arm.direction) % (2.0 * np.pi)
        if not 0.0 < angle < _FLAT:
            continue
        # The side towards the next arm: left of an arm that leaves, right of the next one.
        near, far = _width(network, arm, left=True), _width(network, arms[after], left=False)
        round_off = _CORNER / np.tan(angle / 2.0)
        reach[number] = max(reach[number], (far + near * np.cos(angle)) / np.sin(angle) + round_off)
        reach[after] = max(reach[after], (near + far * np.cos(angle)) / np.sin(angle) + round_off)
    return reach


def _width(network: StreetNetwork, arm: Arm, *, left: bool) -> float:
    """Distance of the kerb from the middle, on a side as seen when leaving the node."""
    section = network.streets[arm.street].section
    return section.left if left == arm.at_start else section.right
