"""Lanes, their sections and layers (ASAM OpenDRIVE, chapter 11)."""

from dataclasses import dataclass, field

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.kept_records import Record
from envgen_usd.models.road_marks import RoadMark

DRIVEN = frozenset(
    (
        *("driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane"),
        *("bus", "taxi", "HOV", "bidirectional", "shared"),
    )
)
"""Types of lanes for vehicles."""
WALKED = frozenset(("sidewalk", "walking"))
"""Types of lanes for pedestrians alone."""


@dataclass(frozen=True, repr=False, eq=False)
class Lane(Model):
    """A lane of a lane section (11.4 to 11.8).

    Attributes:
        id: Positive left of the centre lane, negative right of it, 0 for the centre lane.
        type: Lane type; ``none`` where the file gives no type.
        level: True: superelevation does not tilt the lane.
        width: Metres by ds, the distance from the section's start.
        border: t of the outer border by ds, for lanes without a width; otherwise without pieces.
        height: H x 3, (sOffset, inner, outer), metres above the road plane.
        marks: Road marks, by ascending `s_offset`.
        predecessors: Lane ids in the previous lane section or linked road.
        successors: Lane ids in the next lane section or linked road.
        speed: S x 2, (sOffset, m/s); infinity without a limit.
        material: Surface material; empty where the file gives no material.
        direction: ``standard``, ``reversed`` or ``both`` (1.8).
        extra: access, rule, user data and all other child elements.
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


@dataclass(frozen=True, repr=False, eq=False)
class LaneSection(Model):
    """A lane section of a road (11.3).

    Attributes:
        s: Start, metres along the reference line.
        end: End: the start of the next section or the road's length.
        left: Lanes 1, 2, 3, ... from the centre lane outwards.
        centre: Lane 0.
        right: Lanes -1, -2, -3, ... from the centre lane outwards.
    """

    s: float
    end: float
    left: tuple[Lane, ...]
    centre: Lane
    right: tuple[Lane, ...]


@dataclass(frozen=True, repr=False, eq=False)
class LaneLayer(Model):
    """Lanes that replace the permanent lanes for a time, e.g. at road works (11.2 of 1.9).

    Attributes:
        name: Name of the layer, e.g. ``temporary``.
        lane_offset: t of the centre lane by s.
        sections: Lane sections; they need not cover the whole road.
    """

    name: str
    lane_offset: Cubics
    sections: tuple[LaneSection, ...]
