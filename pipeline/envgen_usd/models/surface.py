"""The road as one surface: what the reader of OpenDRIVE hands to every other layer."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.errors import Issue
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.city import CityObject


@dataclass(frozen=True)
class Patch:
    """A part of the road surface with one meaning.

    Attributes:
        id: Stable and unique, an NCName, e.g. ``road_7_s0_lane_-1``.
        kind: ``lane``, ``mark``, ``kerb`` (a vertical face), ``junction`` (area of a junction that
            no lane alone owns), ``transition`` (closes a gap between linked ends), ``crosswalk``,
            ``island`` (raised, on the road), ``deck`` (under and beside a bridge), ``filler``.
        lane_type: OpenDRIVE lane type (``driving``, ``sidewalk``, ``shoulder``, ...). A mark has
            the type of the lane it lies on; a lane of type ``none`` in a junction that goes on
            from a paved one has that one's type.
        road: OpenDRIVE road id, empty for a junction's own area.
        section: Index of the lane section, -1 where there is none.
        lane: Lane id, 0 where there is none.
        junction: OpenDRIVE junction id, empty outside junctions.
        colour: Colour of a mark as in the file (``standard``, ``white``, ``yellow``, ...); else
            empty. The environment decides what ``standard`` looks like. A crosswalk without one is
            bare road between lines.
        mark_type: OpenDRIVE road mark type; else empty.
        material: Surface material of the lane where the file says one (``asphalt``, ...).
    """

    id: str
    kind: str
    lane_type: str
    road: str = ""
    section: int = -1
    lane: int = 0
    junction: str = ""
    colour: str = ""
    mark_type: str = ""
    material: str = ""


@dataclass(frozen=True)
class LaneLine:
    """Centre line of a lane, in the direction of travel.

    Attributes:
        id: Id of the lane's traffic space, e.g. ``road_7_s0_lane_-1``; a lane's patch has it too.
        road: OpenDRIVE road id.
        section: Index of the lane section.
        lane: Lane id.
        lane_type: OpenDRIVE lane type.
        junction: OpenDRIVE junction id, empty outside junctions.
        points: N x 3, metres, road frame, within the tolerance of the curve.
        width: N, metres.
        speed: Speed limit in m/s, 0 where the file gives none.
        predecessors: Ids of the lane lines from which traffic comes.
        successors: Ids of the lane lines where traffic goes.
        left: Id of the lane to the left in the direction of travel that traffic may change to, or
            empty.
        right: Id of the lane to the right that traffic may change to, or empty.
    """

    id: str
    road: str
    section: int
    lane: int
    lane_type: str
    junction: str
    points: FloatArray
    width: FloatArray
    speed: float = 0.0
    predecessors: tuple[str, ...] = ()
    successors: tuple[str, ...] = ()
    left: str = ""
    right: str = ""


@dataclass(frozen=True)
class RoadLine:
    """Reference line of a road, with what lies across it.

    Attributes:
        road: OpenDRIVE road id.
        junction: OpenDRIVE junction id, empty outside junctions.
        s: N, metres along the reference line, ascending.
        points: N x 3, metres, road frame.
        heading: N, radians, direction of increasing s.
        t_left: N, t of the outermost left border, metres, >= t_right.
        t_right: N, t of the outermost right border.
        town: Type of road where the file gives one (``town``, ``motorway``, ``rural``, ...).
        speed: Speed limit in m/s, 0 where there is none.
    """

    road: str
    junction: str
    s: FloatArray
    points: FloatArray
    heading: FloatArray
    t_left: FloatArray
    t_right: FloatArray
    town: str = ""
    speed: float = 0.0

    def left_border(self) -> FloatArray:
        """N x 2, outermost left border in plan."""
        return self._border(self.t_left)

    def right_border(self) -> FloatArray:
        """N x 2, outermost right border in plan."""
        return self._border(self.t_right)

    def _border(self, t: FloatArray) -> FloatArray:
        normal = np.column_stack([-np.sin(self.heading), np.cos(self.heading)])
        border: FloatArray = self.points[:, :2] + t[:, None] * normal
        return border


@dataclass(frozen=True)
class JunctionSite:
    """A junction, whether it has an area or not.

    Attributes:
        id: OpenDRIVE junction id.
        name: As in the file.
        type: ``default``, ``virtual``, ``direct`` or ``crossing``.
        main_road: Road of a virtual junction, with `s_start`, `s_end` and `orientation`.
        s_start: Metres on the main road.
        s_end: Metres on the main road.
        orientation: Of the main road's traffic that it is for: ``+``, ``-`` or ``none``.
        roads: Ids of the roads that meet there, without those inside.
        stretches: Road, first and last s of the pieces of roads that lie in it or lead to it.
        ways: Ids of two lanes each: traffic may go from the first, somewhere along it, to the
            second, or to a place along that.
    """

    id: str
    name: str
    type: str
    main_road: str = ""
    s_start: float = 0.0
    s_end: float = 0.0
    orientation: str = ""
    roads: tuple[str, ...] = ()
    stretches: tuple[tuple[str, float, float], ...] = ()
    ways: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class RoadSurface:
    """All roads as one triangulated surface.

    Vertices lie on the grid `chunks.GRID`, so that equal places are equal numbers and survive
    being written as text. In plan the patches that are not kerbs do not overlap (bridge decks, in
    `levels` above 0, lie over others). Neighbouring triangles share their vertices.

    Attributes:
        vertices: V x 3, metres, road frame.
        triangles: T x 3, counter-clockwise seen from above; kerbs face the lower side.
        triangle_patch: T, index into `patches`.
        triangle_level: T, 0 for what lies on the ground, 1 and up for decks above it, negative
            for tunnels.
        patches: What the triangles mean.
        outline: Closed loops (vertex indices, not repeated at the end) along which the ground meets
            the road; outer loops counter-clockwise, holes clockwise.
        lanes: Lane centre lines.
        roads: Reference lines.
        furniture: Features from the file's objects and signals (``CityFurniture``,
            ``SolitaryVegetationObject``, ``Building``, ``GenericOccupiedSpace``).
        crs: The geoReference of the file, or empty.
        offset: The header's offset (x, y, z), metres: to be added to get coordinates in `crs`.
        issues: What was odd in the geometry; what was odd in the file is the network's.
        junctions: All junctions.
    """

    vertices: FloatArray
    triangles: IntArray
    triangle_patch: IntArray
    triangle_level: IntArray
    patches: tuple[Patch, ...]
    outline: tuple[IntArray, ...]
    lanes: tuple[LaneLine, ...]
    roads: tuple[RoadLine, ...]
    furniture: tuple[CityObject, ...] = ()
    crs: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    issues: tuple[Issue, ...] = ()
    junctions: tuple[JunctionSite, ...] = ()

    def outline_loops(self) -> list[FloatArray]:
        """Outline as coordinates; each N_i x 3."""
        return [self.vertices[loop] for loop in self.outline]
