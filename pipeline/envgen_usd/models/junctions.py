"""Junctions (ASAM OpenDRIVE, chapter 12)."""

from dataclasses import dataclass

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.records import Record


@dataclass(frozen=True)
class Connection:
    """How an incoming road passes a junction (12.4).

    Attributes:
        id: Id in the file.
        incoming_road: Road that leads into the junction; empty where a virtual junction has none.
        connecting_road: Road through the junction; in a direct junction the linked road; empty
            where there is none.
        contact_point: ``start`` or ``end`` of the connecting road.
        lane_links: (from, to) lane ids.
        extra: predecessor, successor, overlap zones, ...
    """

    id: str
    incoming_road: str
    connecting_road: str
    contact_point: str
    lane_links: tuple[tuple[int, int], ...] = ()
    extra: tuple[Record, ...] = ()


@dataclass(frozen=True)
class BoundarySegment:
    """A piece of a junction's boundary (12.10).

    Attributes:
        type: ``lane`` or ``joint``.
        road: Road id.
        contact_point: For a joint: ``start`` or ``end`` of the road.
        lane: Boundary lane of a lane segment.
        s_start: Start on the road, NaN for its begin or end.
        s_end: End on the road.
        joint_lane_start: First lane of a joint, if given.
        joint_lane_end: Last lane of a joint, if given.
    """

    type: str
    road: str
    contact_point: str = ""
    lane: int = 0
    s_start: float = float("nan")
    s_end: float = float("nan")
    joint_lane_start: int | None = None
    joint_lane_end: int | None = None


@dataclass(frozen=True)
class ElevationGrid:
    """Heights of a junction on a regular grid (12.11).

    Attributes:
        spacing: Metres.
        start: Where the grid's reference begins (s on the junction's plan view), 0 if absent.
        left: One row a grid step, elevations to the left of the centre line.
        centre: Elevation on the centre line at each step.
        right: Elevations to the right.
    """

    spacing: float
    start: float
    left: tuple[FloatArray, ...]
    centre: FloatArray
    right: tuple[FloatArray, ...]


@dataclass(frozen=True)
class Junction:
    """A junction (chapter 12).

    Attributes:
        id: Id in the file.
        name: As in the file.
        type: ``default``, ``virtual``, ``direct`` or ``crossing``.
        connections: Paths through it.
        main_road: Road of a virtual junction, with `s_start`, `s_end`, `orientation`.
        boundary: Border of its area, where the file gives one.
        elevation_grid: Heights, where the file gives them.
        plan_view: Reference line of the elevation grid, where the file gives one.
        extra: priority, controller, crossPath, roadSection, user data, ...
        line: Line in the file.
    """

    id: str
    name: str
    type: str
    connections: tuple[Connection, ...] = ()
    main_road: str = ""
    s_start: float = 0.0
    s_end: float = 0.0
    orientation: str = ""
    boundary: tuple[BoundarySegment, ...] = ()
    elevation_grid: ElevationGrid | None = None
    plan_view: PlanView | None = None
    extra: tuple[Record, ...] = ()
    line: int = 0
