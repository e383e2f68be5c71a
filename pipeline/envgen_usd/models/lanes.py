"""Lanes, their sections and layers (ASAM OpenDRIVE, chapter 11)."""

from dataclasses import dataclass, field

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.records import Record
from envgen_usd.models.road_marks import RoadMark

DRIVEN = frozenset(
    (
        *("driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane"),
        *("bus", "taxi", "HOV", "bidirectional", "shared"),
    )
)
"""Types of lanes for vehicles."""


@dataclass(frozen=True)
class Lane:
    """A lane of one lane section (11.4 to 11.8).

    Attributes:
        id: Positive to the left, negative to the right, 0 the centre lane.
        type: Lane type (``none`` where the file gives none).
        level: True: the lane does not tilt with superelevation.
        width: Width by ds from the section's start.
        border: t of the outer border by ds, where no width is given; else no pieces.
        height: H x 3, (sOffset, inner, outer), metres above the road plane.
        marks: Road marks, by s_offset.
        predecessors: Lane ids in the previous section or linked road.
        successors: Lane ids in the next section or linked road.
        speed: S x 2, (sOffset, m/s); infinity for no limit.
        material: Name of the surface, empty where none is given.
        direction: ``standard``, ``reversed`` or ``both`` (1.8).
        extra: access, rule, user data and whatever else there was.
    """

    id: int
    type: str
    level: bool = False
    width: Cubics = NO_CUBICS
    border: Cubics = NO_CUBICS
    height: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    marks: tuple[RoadMark, ...] = ()
    predecessors: tuple[int, ...] = ()
    successors: tuple[int, ...] = ()
    speed: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    material: str = ""
    direction: str = "standard"
    extra: tuple[Record, ...] = ()


@dataclass(frozen=True)
class LaneSection:
    """Lanes between two places of a road (11.3).

    Attributes:
        s: Start on the road.
        end: End on the road: the start of the next section or the road's length.
        left: Lanes 1, 2, 3, ... from the centre outwards.
        centre: Lane 0.
        right: Lanes -1, -2, -3, ... from the centre outwards.
    """

    s: float
    end: float
    left: tuple[Lane, ...]
    centre: Lane
    right: tuple[Lane, ...]


@dataclass(frozen=True)
class LaneLayer:
    """Lanes that hold instead of the permanent ones, e.g. in road works (11.2 of 1.9).

    Attributes:
        name: Layer, e.g. ``temporary``.
        lane_offset: t of the centre lane by s.
        sections: Its sections; they need not cover the road.
    """

    name: str
    lane_offset: Cubics
    sections: tuple[LaneSection, ...]
