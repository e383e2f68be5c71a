"""A Lanelet2 map: lanelets between two linestrings each, with what regulates them.

Terms and tags follow Lanelet2 (Poggenhans et al., ITSC 2018).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model

VEHICLE = frozenset(
    ("road", "highway", "play_street", "bus_lane", "emergency_lane", "exit", "bicycle_lane")
)
"""Subtypes of lanelets on a carriageway, whose overlaps are junctions."""
FOOT = frozenset(("walkway", "shared_walkway", "pedestrian_lane", "stairs"))
"""Subtypes of lanelets for pedestrians beside a carriageway."""


@dataclass(frozen=True, repr=False, eq=False)
class LaneletLine(Model):
    """A linestring.

    Attributes:
        id: Id of the way.
        points: N x 3, metres.
        ends: Numbers of its first and last place; ends at one place have one number.
        tags: Its tags.
    """

    id: int
    points: FloatArray
    ends: tuple[int, int]
    tags: Mapping[str, str]

    @property
    def type(self) -> str:
        """Value of the tag ``type``."""
        return self.tags.get("type", "")

    @property
    def subtype(self) -> str:
        """Value of the tag ``subtype``."""
        return self.tags.get("subtype", "")


@dataclass(frozen=True)
class Side:
    """A bound of a lanelet.

    Attributes:
        line: Index of the linestring.
        forward: True where the linestring runs along the lanelet.
    """

    line: int
    forward: bool

    @property
    def turned(self) -> "Side":
        """The same linestring, run through the other way."""
        return Side(self.line, not self.forward)


@dataclass(frozen=True)
class Lanelet:
    """A lanelet.

    Attributes:
        id: Id of the relation.
        left: Bound on its left.
        right: Bound on its right.
        subtype: Value of the tag ``subtype``.
        one_way: True where traffic runs along it only.
        speed: Speed limit in km/h; 0 without one.
        tags: Its tags.
        regulations: Ids of its regulatory elements.
    """

    id: int
    left: Side
    right: Side
    subtype: str
    one_way: bool
    speed: float
    tags: Mapping[str, str]
    regulations: tuple[int, ...] = ()


@dataclass(frozen=True)
class Regulation:
    """A regulatory element.

    Attributes:
        id: Id of the relation.
        subtype: ``traffic_light``, ``traffic_sign``, ``speed_limit``, ``right_of_way``, ...
        refers: Indices of the linestrings that it refers to.
        stops: Indices of the linestrings before which it makes traffic stop.
        lanelets: Role to indices of lanelets: ``right_of_way``, ``yield``.
        tags: Its tags.
    """

    id: int
    subtype: str
    refers: tuple[int, ...]
    stops: tuple[int, ...]
    lanelets: Mapping[str, tuple[int, ...]]
    tags: Mapping[str, str]


@dataclass(frozen=True, repr=False, eq=False)
class LaneletMap(Model):
    """A map.

    Attributes:
        lines: Linestrings.
        lanelets: Lanelets whose members all exist.
        regulations: Regulatory elements by id.
        crs: Coordinate reference system as a PROJ string; empty where it is unknown.
        offset: x and y in that system of the origin of all points, metres.
        source: Name of the file.
        issues: What was left out or decided.
        counts: What was read and left out, by name.
    """

    lines: tuple[LaneletLine, ...]
    lanelets: tuple[Lanelet, ...]
    regulations: Mapping[int, Regulation]
    crs: str = ""
    offset: tuple[float, float] = (0.0, 0.0)
    source: str = ""
    issues: tuple[Issue, ...] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
