"""The road surface: the interface from the OpenDRIVE reader to all other layers."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.road_feature import RoadFeature
from envgen_usd.models.road_objects import Origin

_MOTORWAYS = frozenset({"motorway", "townExpressway"})
"""Road types (OpenDRIVE e_roadType)."""
_MOTORWAY_SPEED = 27.0
"""Least speed limit of a motorway, m/s; a larger value gives more roads plots and trees."""


KERB_STONE = "kerb_stone"
"""Kind of the edge of a raised sidewalk."""
KERBS = frozenset(("kerb", KERB_STONE))
"""Kinds of patches that are kerbs: no traffic is on them."""


@dataclass(frozen=True)
class Patch:
    """A semantic part of the road surface.

    Attributes:
        id: Stable and unique, an NCName, e.g. ``road_7_s0_lane_-1``.
        kind: ``lane``, ``mark``, ``kerb`` (a vertical face), ``kerb_stone`` (the edge of a raised
            sidewalk), ``junction`` (area that several connecting roads share), ``transition``
            (closes a gap between linked lane ends), ``crosswalk``, ``parking`` (a bay),
            ``road_surface`` (a repair, a manhole, ...), ``island`` (raised, on the road), ``deck``
            (under and beside a bridge), ``filler`` (closes a small hole).
        lane_type: OpenDRIVE lane type (``driving``, ``sidewalk``, ``shoulder``, ...). A mark has
            the type of the lane below it. In a junction, a lane of type ``none`` takes the type
            of the paved lane that it continues.
        road: OpenDRIVE road id; empty for a junction's shared area.
        section: Index of the lane section; -1 without a section.
        lane: Lane id; 0 without a lane.
        junction: OpenDRIVE junction id; empty outside junctions.
        colour: Colour of a mark as in the file (``standard``, ``white``, ``yellow``, ...); the
            environment gives ``standard`` its colour. Empty for all other patches. A crosswalk
            without a colour is bare road between lines.
        mark_type: OpenDRIVE road mark type; empty for patches without paint.
        material: Surface material of the lane (``asphalt``, ...); empty where the file gives none.
        origin: Object or signal that the patch shows; `None` for all other patches.
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
    origin: Origin | None = None


@dataclass(frozen=True, repr=False, eq=False)
class LaneLine(Model):
    """Centre line of a lane, in the direction of travel.

    Attributes:
        id: Id of the lane's traffic space and patch, e.g. ``road_7_s0_lane_-1``.
        road: OpenDRIVE road id.
        section: Index of the lane section.
        lane: Lane id.
        lane_type: OpenDRIVE lane type.
        junction: OpenDRIVE junction id; empty outside junctions.
        points: N x 3, metres, road frame; the chord error is below the surface's tolerance.
        width: N, metres.
        speed: Speed limit in m/s; 0 where the file gives no limit.
        predecessors: Ids of the lane lines that lead into this lane line.
        successors: Ids of the lane lines that follow this lane line.
        left: Id of the lane for a lane change to the left in the direction of travel; empty where
            the marks permit no change.
        right: Id of the lane for a lane change to the right; empty where the marks permit no
            change.
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


@dataclass(frozen=True, repr=False, eq=False)
class RoadLine(Model):
    """Reference line of a road with its outermost borders.

    Attributes:
        road: OpenDRIVE road id.
        junction: OpenDRIVE junction id; empty outside junctions.
        s: N, metres along the reference line, ascending.
        points: N x 3, metres, road frame.
        heading: N, radians, direction of increasing s.
        t_left: N, metres, t of the outermost left border, >= t_right.
        t_right: N, metres, t of the outermost right border.
        town: Road type (``town``, ``motorway``, ``rural``, ...); empty where the file gives none.
        speed: Speed limit in m/s; 0 where the file gives no limit.
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

    @property
    def is_motorway(self) -> bool:
        """True for roads that are built for fast traffic alone, by their type or speed limit."""
        return self.town in _MOTORWAYS or self.speed >= _MOTORWAY_SPEED

    def left_border(self) -> FloatArray:
        """Returns the outermost left border in plan, N x 2, metres, road frame."""
        return self._border(self.t_left)

    def right_border(self) -> FloatArray:
        """Returns the outermost right border in plan, N x 2, metres, road frame."""
        return self._border(self.t_right)

    def _border(self, t: FloatArray) -> FloatArray:
        normal = np.column_stack([-np.sin(self.heading), np.cos(self.heading)])
        border: FloatArray = self.points[:, :2] + t[:, None] * normal
        return border


@dataclass(frozen=True, repr=False, eq=False)
class JunctionSite(Model):
    """A junction, with or without an area.

    Attributes:
        id: OpenDRIVE junction id.
        name: As in the file.
        type: ``default``, ``virtual``, ``direct`` or ``crossing``.
        main_road: Id of a virtual junction's main road; empty for the other types.
        s_start: Start of a virtual junction on its main road, metres.
        s_end: End of a virtual junction on its main road, metres.
        orientation: Direction of the main road's traffic that may use a virtual junction: ``+``,
            ``-`` or ``none``.
        roads: Ids of the roads that meet at the junction, without its connecting roads.
        stretches: Road id, first s and last s of each road stretch in the junction or leading to
            it.
        ways: Pairs of lane ids (from, to) along which traffic passes a virtual junction. Traffic
            may leave or enter a lane at any position along that lane.
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


@dataclass(frozen=True, repr=False, eq=False)
class RoadSurface(Model):
    """All roads as a single triangulated surface.

    Vertices lie on the grid `chunks.GRID`, so coordinates compare exactly, also after a round trip
    through text. In plan, patches of level 0 do not overlap, except vertical kerbs; decks lie over
    other patches. Neighbouring triangles share their vertices.

    Attributes:
        vertices: V x 3, metres, road frame.
        triangles: T x 3, counter-clockwise seen from above; kerbs face the lower side.
        triangle_patch: T, index into `patches`.
        triangle_level: T, 0 for roads on the ground, 1 and up for bridge decks, negative for
            tunnels.
        patches: Semantics of the triangles.
        outline: Closed loops of vertex indices between ground and road, without repeated last
            index; outer loops counter-clockwise, holes clockwise.
        lanes: Lane centre lines.
        roads: Reference lines.
        features: Objects and signals of the file beside the roads.
        crs: The geoReference of the file; empty where the file gives none.
        offset: Header offset (x, y, z), metres; coordinates in `crs` are vertices plus this offset.
        issues: Issues of the geometry; those of the file belong to the `RoadNetwork`.
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
    features: tuple[RoadFeature, ...] = ()
    crs: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    issues: tuple[Issue, ...] = ()
    junctions: tuple[JunctionSite, ...] = ()

    def outline_loops(self) -> list[FloatArray]:
        """Returns the outline's loops as coordinates, each N_i x 3, metres, road frame."""
        return [self.vertices[loop] for loop in self.outline]
