"""Junctions (ASAM OpenDRIVE, chapter 12)."""

from dataclasses import dataclass

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.kept_records import Record
from envgen_usd.models.plan_view import PlanView


@dataclass(frozen=True)
class Connection:
    """A connection from an incoming road through a junction (12.4).

    Attributes:
        id: Id in the file.
        incoming_road: Road that leads into the junction; empty for some virtual junctions.
        connecting_road: Road through the junction; in a direct junction, the linked road. Empty
            where the file names no road.
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
    """A segment of a junction's boundary (12.10).

    Attributes:
        type: ``lane`` or ``joint``.
        road: Road id.
        contact_point: For a joint, ``start`` or ``end`` of the road.
        lane: For a lane segment, the lane at the boundary.
        s_start: Metres along the road; NaN for the road's start or end.
        s_end: Metres along the road; NaN for the road's start or end.
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


@dataclass(frozen=True, repr=False, eq=False)
class ElevationGrid(Model):
    """Heights of a junction on a regular grid (12.11).

    Attributes:
        spacing: Metres.
        start: s on the junction's reference line at which the grid begins, metres; 0 if absent.
        left: Elevations left of the centre line, metres; a row for each grid step.
        centre: Elevation on the centre line at each grid step, metres.
        right: Elevations right of the centre line, metres; a row for each grid step.
    """

    spacing: float
    start: float
    left: tuple[FloatArray, ...]
    centre: FloatArray
    right: tuple[FloatArray, ...]


@dataclass(frozen=True, repr=False, eq=False)
class Junction(Model):
    """A junction (chapter 12).

    Attributes:
        id: Id in the file.
        name: As in the file.
        type: ``default``, ``virtual``, ``direct`` or ``crossing``.
        connections: Connections through the junction.
        main_road: Main road of a virtual junction, from `s_start` to `s_end`; see `orientation`.
        boundary: Boundary of the junction's area, where the file gives it.
        elevation_grid: Heights; `None` where the file gives no grid.
        plan_view: Reference line of the elevation grid; `None` where the file gives no plan view.
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
