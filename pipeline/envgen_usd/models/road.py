"""The road network of an OpenDRIVE file (ASAM OpenDRIVE 1.1 to 1.9).

Names are those of the standard. Lengths are metres, angles radians, speeds m/s. Rarely used
elements stay in `extra` as XML attributes, so the models lose no content of the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from envgen_usd.errors import Issue
from envgen_usd.models.cubics import Cubics
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.junctions import Junction
from envgen_usd.models.kept_records import Record
from envgen_usd.models.lanes import LaneLayer, LaneSection
from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.models.road_profiles import CrossSectionSurface, Shapes
from envgen_usd.models.signals import Signal


@dataclass(frozen=True)
class RoadLink:
    """Link of a road's start or end (8.2).

    Attributes:
        element: ``road`` or ``junction``.
        id: Id of the linked road or junction.
        contact_point: ``start`` or ``end`` of the linked road; empty for a junction and for a
            position along a road (`s`).
        s: Position on the linked road in metres (elementS); NaN for its start or end.
        direction: elementDir, ``+`` or ``-``; empty where `s` is NaN.
    """

    element: str
    id: str
    contact_point: str = ""
    s: float = float("nan")
    direction: str = ""


@dataclass(frozen=True)
class RoadType:
    """Road type from s on (8.3): ``town``, ``motorway``, ... with its speed limit (m/s)."""

    s: float
    type: str
    country: str = ""
    speed: float = 0.0


@dataclass(frozen=True, repr=False, eq=False)
class Road(Model):
    """A road (chapter 8).

    Attributes:
        id: Id in the file (any string).
        name: As in the file.
        length: Metres of reference line, as its geometries give it.
        junction: Id of the road's junction; empty outside junctions.
        rule: ``RHT`` or ``LHT``.
        predecessor: Link at the road's start; `None` without a link.
        successor: Link at the road's end; `None` without a link.
        types: Road types along s.
        plan_view: Reference line.
        elevation: z by s.
        superelevation: Roll by s.
        shapes: Lateral profiles; `None` where the file gives no profile.
        cross_section: Replaces superelevation and shapes; `None` where the file gives no surface.
        lane_offset: t of the centre lane by s.
        sections: Lane sections of the permanent layer, ascending.
        objects: Objects, bridges, tunnels and object references.
        signals: Signals and signal references.
        extra: surface (CRG), railroad, user data, ...
        line: Line in the file.
        layers: Lane layers other than the permanent layer.
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


@dataclass(frozen=True, repr=False, eq=False)
class RoadNetwork(Model):
    """The content of an OpenDRIVE file.

    Attributes:
        name: Name of the map (the file's stem).
        roads: Roads by id, in the file's order.
        junctions: Junctions by id, in the file's order.
        revision: Declared revision, e.g. ``1.4``; informative only.
        geo_reference: PROJ string or WKT; empty where the file gives no reference.
        offset: Header offset (x, y, z, heading) as in the file. The heading already turned all
            coordinates; users apply the translation.
        controllers: Controllers, junction groups, stations, user data, ...
        issues: Warnings, errors and repairs of the file.
    """

    name: str
    roads: Mapping[str, Road]
    junctions: Mapping[str, Junction]
    revision: str = ""
    geo_reference: str = ""
    offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    controllers: tuple[Record, ...] = ()
    issues: tuple[Issue, ...] = ()
