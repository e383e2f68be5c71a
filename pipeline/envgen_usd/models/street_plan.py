"""Streets of a real place as a map draws them, before they are roads with junctions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model

CARRIAGEWAY = frozenset({"driving", "biking", "shoulder", "restricted"})
"""Kinds of lanes that lie between the kerbs of a junction's mouth."""


@dataclass(frozen=True)
class StreetLane:
    """A lane of a street.

    Attributes:
        kind: ``driving``, ``biking``, ``parking``, ``shoulder``, ``sidewalk``, or ``restricted``
            between the directions beside an island.
        width: Metres.
        turns: Directions painted on it, of ``left``, ``through`` and ``right``; empty: none.
        raised: True for a cycle track as high as the sidewalk.
        stays: Sides, ``left`` and ``right`` as traffic sees them, to which it may not change.
    """

    kind: str
    width: float
    turns: frozenset[str] = frozenset()
    raised: bool = False
    stays: frozenset[str] = frozenset()


@dataclass(frozen=True)
class StreetProfile:
    """Cross-section of a stretch, for traffic on the right.

    Attributes:
        left: Lanes left of the line from the middle outwards; their traffic runs against it.
        right: Lanes right of the line from the middle outwards.
        shared: True where the only driving lane, on the right, serves both directions.
        kind: Value of the tag ``highway``.
        rank: Importance of the street, larger for more important ones.
        speed: Speed limit, km/h.
        level: Layer of the map: 0 on the ground, 1 on a bridge above it, -1 in a tunnel.
        structure: ``bridge``, ``tunnel`` or empty.
        lined: True where lines part the directions of traffic.
        marked: False where no line is painted.
        line: Where the map's line lies: a side, and the number of lanes between the middle and the
            line, halves for the middle of a lane; `TRANSITION`: it goes over from the stretch
            before to the one after. `None`: in the middle of the carriageway.
    """

    TRANSITION: ClassVar[tuple[str, float]] = ("transition", 0.0)

    left: tuple[StreetLane, ...]
    right: tuple[StreetLane, ...]
    shared: bool = False
    kind: str = "residential"
    rank: int = 1
    speed: int = 50
    level: int = 0
    structure: str = ""
    lined: bool = True
    marked: bool = True
    line: tuple[str, float] | None = None

    def driving(self, side: str) -> int:
        """Number of driving lanes on a side."""
        lanes: tuple[StreetLane, ...] = getattr(self, side)
        return sum(lane.kind == "driving" for lane in lanes)

    def reversed(self) -> "StreetProfile":
        """The same cross-section, seen along the reversed line."""
        values = {**vars(self), "left": self.right, "right": self.left}
        if self.line is not None:
            side, lanes = self.line
            values["line"] = {"left": "right", "right": "left"}.get(side, side), lanes
        if self.shared:
            values |= {"left": self.left, "right": self.right}
        return StreetProfile(**values)


@dataclass(frozen=True, repr=False, eq=False)
class MappedStreet(Model):
    """A chain of ways between two nodes where more than two ways meet, or one ends.

    Attributes:
        start: Number of its first node.
        end: Number of its last node.
        line: N x 2, metres.
        breaks: Index into `line` at which each stretch begins; the first is 0.
        profiles: Cross-section of each stretch.
        ways: Id of the map's way of each stretch.
        name: Name of the street; may be empty.
        ring: True for a part of a roundabout.
    """

    start: int
    end: int
    line: FloatArray
    breaks: tuple[int, ...]
    profiles: tuple[StreetProfile, ...]
    ways: tuple[int, ...]
    name: str = ""
    ring: bool = False

    @property
    def length(self) -> float:
        """Length of the line, metres."""
        return float(np.linalg.norm(np.diff(self.line, axis=0), axis=1).sum())


@dataclass(frozen=True, repr=False, eq=False)
class StreetPoint(Model):
    """What the map has at a point of a street, or beside it.

    Attributes:
        kind: ``zebra``, ``crossing``, ``island``, ``signals``, ``stop`` or ``give_way`` on a
            street; ``sign``
            on or beside one; what stands beside one: ``tree``, ``lamp``, ``bench``, ``bin``, ...;
            ``gate`` in a line.
        place: x and y, metres.
        along: For signs: 1 for traffic along the way, -1 against it, 0 unknown.
        way: Id of the way, 0 where the point lies on several.
        code: Country and number of a sign, e.g. ``DE:274-50``.
    """

    kind: str
    place: FloatArray
    along: int = 0
    way: int = 0
    code: str = ""


@dataclass(frozen=True, repr=False, eq=False)
class MapLine(Model):
    """A hedge, fence, wall or railway of the map.

    Attributes:
        kind: ``hedge``, ``fence``, ``wall`` or ``rail``.
        line: N x 2, metres.
        height: Metres; NaN where unknown.
    """

    kind: str
    line: FloatArray
    height: float = float("nan")


@dataclass(frozen=True, repr=False, eq=False)
class StreetPlan(Model):
    """The streets of a place.

    Attributes:
        nodes: N x 2, metres; of the ends of streets.
        streets: The streets.
        points: Crossings, signals and signs.
        banned: Way, node number and way of turns that are not allowed.
        crs: Coordinate reference system as a PROJ string.
        source: Name of the file.
        issues: What was left out or decided.
        counts: What was read and left out, by name.
        lines: Hedges, fences, walls and railways.
    """

    nodes: FloatArray
    streets: tuple[MappedStreet, ...]
    points: tuple[StreetPoint, ...] = ()
    banned: frozenset[tuple[int, int, int]] = frozenset()
    crs: str = ""
    source: str = ""
    issues: tuple[Issue, ...] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
    lines: tuple[MapLine, ...] = ()
