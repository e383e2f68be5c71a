"""Streets in plan, before they are roads with lanes: lines between nodes, and cross-sections."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model


@dataclass(frozen=True)
class CrossSection:
    """What lies beside the middle of a street, for traffic on the right.

    Attributes:
        forward: Lanes in the direction of the line, to its right.
        backward: Lanes against it, to its left; 0 for a one-way street.
        lane_width: Width of a lane, metres.
        parking: Width of a parking lane on both sides, metres; 0: none. Before junctions the
            sidewalk takes its place.
        sidewalk: Width of the sidewalk on both sides, metres, beside parking lanes; 0: none.
        speed: Speed limit, km/h.
        main: Traffic on it has priority.
    """

    forward: int = 1
    backward: int = 1
    lane_width: float = 3.25
    parking: float = 0.0
    sidewalk: float = 2.0
    speed: int = 50
    main: bool = False

    @property
    def left(self) -> float:
        """Width of the lanes on the left of the middle, without parking, metres."""
        return self.backward * self.lane_width

    @property
    def right(self) -> float:
        """Width of the lanes on the right of the middle, without parking, metres."""
        return self.forward * self.lane_width


@dataclass(frozen=True, repr=False, eq=False)
class Street(Model):
    """A street between two nodes.

    Attributes:
        start: Number of its first node.
        end: Number of its last node.
        line: N x 2, its middle from node to node, metres.
        section: Its cross-section.
    """

    start: int
    end: int
    line: FloatArray
    section: CrossSection


@dataclass(frozen=True, repr=False, eq=False)
class StreetNetwork(Model):
    """Streets that meet at nodes.

    Attributes:
        nodes: N x 2, metres.
        streets: The streets.
    """

    nodes: FloatArray
    streets: tuple[Street, ...]

    @property
    def length(self) -> float:
        """Length of all streets, metres."""
        lines = (np.diff(street.line, axis=0) for street in self.streets)
        return float(sum(np.linalg.norm(steps, axis=1).sum() for steps in lines))
