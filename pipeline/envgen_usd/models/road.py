"""The road network as an OpenDRIVE file holds it (ASAM OpenDRIVE 1.1 to 1.9).

Names are the standard's. Lengths are metres, angles radians, speeds m/s. Elements that few
consumers need keep their XML attributes in `attributes`, so nothing that was read is lost.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from envgen_usd.errors import Issue
from envgen_usd.models.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Cubics:
    """Piecewise cubic ``a + b ds + c ds² + d ds³`` with ``ds = s - start`` of the last piece.

    Attributes:
        start: N, ascending.
        coefficients: N x 4, (a, b, c, d).
    """

    start: FloatArray
    coefficients: FloatArray

    def __call__(self, s: FloatArray) -> FloatArray:
        """Value at each s (any shape); 0 everywhere where there is no piece.

        Before the first piece the first one is extended.
        """
        if not len(self.start):
            return np.zeros_like(s)
        piece = np.maximum(np.searchsorted(self.start, s, side="right") - 1, 0)
        ds = s - self.start[piece]
        a, b, c, d = np.moveaxis(self.coefficients[piece], -1, 0)
        value: FloatArray = a + ds * (b + ds * (c + ds * d))
        return value

    def derivative(self, s: FloatArray) -> FloatArray:
        """First derivative at each s."""
        if not len(self.start):
            return np.zeros_like(s)
        piece = np.maximum(np.searchsorted(self.start, s, side="right") - 1, 0)
        ds = s - self.start[piece]
        _, b, c, d = np.moveaxis(self.coefficients[piece], -1, 0)
        slope: FloatArray = b + ds * (2 * c + 3 * ds * d)
        return slope


NO_CUBICS = Cubics(np.empty(0), np.empty((0, 4)))


class Curve(IntEnum):
    """Kinds of plan-view geometry (9.3 to 9.7)."""

    LINE = 0
    ARC = 1
    SPIRAL = 2
    POLY3 = 3
    PARAM_POLY3 = 4


@dataclass(frozen=True)
class PlanView:
    """Reference line of a road (chapter 9); G geometries.

    Attributes:
        s: G, start of each geometry, ascending.
        x: G, start.
        y: G, start.
        heading: G, radians at the start.
        length: G.
        kind: G, `Curve` values.
        curvature: G x 2, curvature at start and end in 1/m (line: 0, 0; arc: equal).
        cubic: G x 8, for POLY3 (a, b, c, d, 0, 0, 0, 0), for PARAM_POLY3
            (aU, bU, cU, dU, aV, bV, cV, dV).
        p_range: G, value of p at the end of a PARAM_POLY3 (1 if normalised, else its length).
    """

    s: FloatArray
    x: FloatArray
    y: FloatArray
    heading: FloatArray
    length: FloatArray
    kind: IntArray
    curvature: FloatArray
    cubic: FloatArray
    p_range: FloatArray


@dataclass(frozen=True)
class RoadMarkLine:
    """One line of a mark's explicit type (11.9): dashes of `length` with gaps of `space`."""

    length: float
    space: float
    t_offset: float
    s_offset: float
    width: float
    rule: str = ""
    colour: str = ""


@dataclass(frozen=True)
class RoadMark:
    """A mark along a lane's outer border (11.9).

    Attributes:
        s_offset: From the start of the lane section.
        type: ``solid``, ``broken``, ``solid solid``, ...
        weight: ``standard`` or ``bold``.
        colour: As in the file.
        width: Metres; -1 where the file gives none.
        height: Metres above the road.
        lane_change: ``increase``, ``decrease``, ``both``, ``none`` or empty.
        material: As in the file.
        lines: Lines of the `<type>` element, repeated along the mark.
        explicit: Lines of the `<explicit>` element, not repeated.
        sway: t offset along s, relative to the section.
    """

    s_offset: float
    type: str
    weight: str = "standard"
    colour: str = "standard"
    width: float = -1.0
    height: float = 0.0
    lane_change: str = ""
    material: str = ""
    lines: tuple[RoadMarkLine, ...] = ()
    explicit: tuple[RoadMarkLine, ...] = ()
    sway: Cubics = NO_CUBICS


@dataclass(frozen=True)
class Record:
    """An element kept by its attributes: speed, access, material, user data, ...

    Attributes:
        tag: Element name.
        attributes: XML attributes.
        children: Elements below.
        text: Text, stripped.
        line: Line in the file.
    """

    tag: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    children: tuple["Record", ...] = ()
    text: str = ""
    line: int = 0


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


@dataclass(frozen=True)
class RoadLink:
    """What a road's end is linked to (8.2).

    Attributes:
        element: ``road`` or ``junction``.
        id: Id of that element.
        contact_point: ``start`` or ``end`` of the linked road, empty for a junction and where
            the link leads to a place along a road (`s`).
        s: Place on the linked road in metres (elementS), NaN where it is one of its ends.
        direction: elementDir, ``+`` or ``-``; empty where `s` is NaN.
    """

    element: str
    id: str
    contact_point: str = ""
    s: float = float("nan")
    direction: str = ""


@dataclass(frozen=True)
class Outline:
    """Outline of an object (13.3).

    Attributes:
        points: N x 3, (s, t, dz) if `in_road` else (u, v, z).
        heights: N, height of the object at each corner.
        ids: N, corner ids, empty strings where there are none.
        in_road: True for cornerRoad, False for cornerLocal.
        closed: False for a line.
        outer: False for an inner ring.
        fill: Fill type, as in the file.
        lane_type: Lane type that the outline stands for, as in the file.
    """

    points: FloatArray
    heights: FloatArray
    ids: tuple[str, ...]
    in_road: bool
    closed: bool = True
    outer: bool = True
    fill: str = ""
    lane_type: str = ""


@dataclass(frozen=True)
class Repeat:
    """Repetition of an object (13.2); distance 0 extrudes it continuously.

    Each pair is the value at the start and at the end; NaN where the file gives none and the
    object's own value holds.
    """

    s: float
    length: float
    distance: float
    t: tuple[float, float]
    z_offset: tuple[float, float]
    width: tuple[float, float]
    height: tuple[float, float]
    extent: tuple[float, float]
    radius: tuple[float, float]
    detach_from_reference_line: bool = False


@dataclass(frozen=True)
class RoadObject:
    """An object beside or on a road (chapter 13), or a tunnel or bridge over a stretch of it.

    Attributes:
        id: Id in the file.
        type: Object type (``tree``, ``pole``, ``crosswalk``, ``tunnel``, ``bridge``, ...).
        subtype: As in the file.
        name: As in the file.
        s: On the road.
        t: On the road.
        z_offset: Above the road.
        heading: Relative to the road.
        pitch: Relative to the road.
        roll: Relative to the road.
        orientation: ``+``, ``-`` or ``none``.
        length: Along its own x; 0 where the file gives none.
        width: Along its own y.
        height: Along its own z.
        radius: Of a round object; 0 where the file gives none.
        outlines: Outer and inner rings.
        repeats: Repetitions.
        extra: markings, borders, parkingSpace, skeleton, material, validity, surface, ...
        line: Line in the file.
        reference: Id of the object that an objectReference repeats for this road; else empty.
    """

    id: str
    type: str
    subtype: str
    name: str
    s: float
    t: float
    z_offset: float
    heading: float
    pitch: float
    roll: float
    orientation: str
    length: float
    width: float
    height: float
    radius: float
    outlines: tuple[Outline, ...] = ()
    repeats: tuple[Repeat, ...] = ()
    extra: tuple[Record, ...] = ()
    line: int = 0
    reference: str = ""


@dataclass(frozen=True)
class Signal:
    """A sign, light or marking that regulates traffic (chapter 14).

    Attributes:
        id: Id in the file.
        name: As in the file.
        type: Country-specific code.
        subtype: Country-specific code.
        country: ISO 3166, as in the file.
        s: On the road.
        t: On the road.
        z_offset: Of its lower edge, above the road.
        heading: `hOffset`, relative to the road, or absolute with `position`.
        pitch: Relative.
        roll: Relative.
        orientation: ``+``, ``-`` or ``none``: for which direction of travel it holds.
        dynamic: True for a light or a board that changes.
        width: Metres, 0 where the file gives none.
        height: Metres, 0 where the file gives none.
        value: Value on the face, NaN where there is none.
        unit: Unit of the value.
        text: Text on the face.
        position: 3, where a positionInertial places it physically; else none.
        reference: Id of the signal that a signalReference repeats; else empty.
        extra: validity, dependency, reference, board, user data, ...
        line: Line in the file.
    """

    id: str
    name: str
    type: str
    subtype: str
    country: str
    s: float
    t: float
    z_offset: float
    heading: float
    pitch: float
    roll: float
    orientation: str
    dynamic: bool
    width: float
    height: float
    value: float
    unit: str
    text: str
    position: tuple[float, float, float] | None = None
    reference: str = ""
    extra: tuple[Record, ...] = ()
    line: int = 0


@dataclass(frozen=True)
class RoadType:
    """Type of a road from s on (8.3): ``town``, ``motorway``, ... with its speed limit (m/s)."""

    s: float
    type: str
    country: str = ""
    speed: float = 0.0


@dataclass(frozen=True)
class Shapes:
    """Lateral profile (10.5.2): at each s, cubics in t.

    Attributes:
        s: K, ascending cross-sections.
        profiles: K, height by t at each.
    """

    s: FloatArray
    profiles: tuple[Cubics, ...]


@dataclass(frozen=True)
class SurfaceStrip:
    """A strip of a crossSectionSurface (10.5.3): its height polynomials along s.

    Attributes:
        id: Positive left of the reference line, negative right.
        mode: ``relative`` or ``independent``.
        width: Width along s.
        constant: Height term along s, by cubics.
        linear: Slope term.
        quadratic: Quadratic term.
        cubic: Cubic term.
    """

    id: int
    mode: str
    width: Cubics
    constant: Cubics
    linear: Cubics
    quadratic: Cubics
    cubic: Cubics


@dataclass(frozen=True)
class CrossSectionSurface:
    """Cross-section by strips (10.5.3); replaces superelevation and shape.

    Attributes:
        t_offset: Along s.
        strips: From the middle outwards, left and right.
    """

    t_offset: Cubics
    strips: tuple[SurfaceStrip, ...]


@dataclass(frozen=True)
class Road:
    """A road (chapter 8).

    Attributes:
        id: Id in the file (any string).
        name: As in the file.
        length: Length of the reference line that is used.
        junction: Id of the junction it belongs to; empty where it belongs to none.
        rule: ``RHT`` or ``LHT``.
        predecessor: Link at its start.
        successor: Link at its end.
        types: Types along s.
        plan_view: Reference line.
        elevation: z by s.
        superelevation: Roll by s.
        shapes: Lateral profiles.
        cross_section: Replaces superelevation and shapes where it is given.
        lane_offset: t of the centre lane by s.
        sections: Lane sections of the permanent layer, ascending.
        objects: Objects, bridges, tunnels and object references.
        signals: Signals and signal references.
        extra: surface (CRG), railroad, user data, ...
        line: Line in the file.
        layers: Other lane layers.
    """

    id: str
    name: str
    length: float
    junction: str
    rule: str
    predecessor: RoadLink | None
    successor: RoadLink | None
    types: tuple[RoadType, ...]
    plan_view: PlanView
    elevation: Cubics
    superelevation: Cubics
    shapes: Shapes | None
    cross_section: CrossSectionSurface | None
    lane_offset: Cubics
    sections: tuple[LaneSection, ...]
    objects: tuple[RoadObject, ...] = ()
    signals: tuple[Signal, ...] = ()
    extra: tuple[Record, ...] = ()
    line: int = 0
    layers: tuple[LaneLayer, ...] = ()


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


@dataclass(frozen=True)
class RoadNetwork:
    """A whole OpenDRIVE file.

    Attributes:
        name: Name of the map (the file's stem).
        roads: By id, in the file's order.
        junctions: By id, in the file's order.
        revision: As declared, e.g. ``1.4``; only informative.
        geo_reference: PROJ string or WKT, empty if there is none.
        offset: Header offset (x, y, z, heading).
        controllers: Controllers, junction groups, stations, user data, ...
        issues: What was odd in the file.
    """

    name: str
    roads: Mapping[str, Road]
    junctions: Mapping[str, Junction]
    revision: str = ""
    geo_reference: str = ""
    offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    controllers: tuple[Record, ...] = ()
    issues: tuple[Issue, ...] = ()
