"""The road network as an OpenDRIVE file holds it (ASAM OpenDRIVE 1.1 to 1.9).

Names are the standard's. Lengths are metres, angles radians, speeds m/s. Elements that few
consumers need keep their XML attributes in `attributes`, so nothing that was read is lost.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from envgen_usd.errors import Issue
from envgen_usd.models.cubics import Cubics
from envgen_usd.models.junctions import Junction
from envgen_usd.models.lanes import LaneLayer, LaneSection
from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.records import Record
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.models.road_profiles import CrossSectionSurface, Shapes
from envgen_usd.models.signals import Signal


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
class RoadType:
    """Type of a road from s on (8.3): ``town``, ``motorway``, ... with its speed limit (m/s)."""

    s: float
    type: str
    country: str = ""
    speed: float = 0.0


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
class RoadNetwork:
    """A whole OpenDRIVE file.

    Attributes:
        name: Name of the map (the file's stem).
        roads: By id, in the file's order.
        junctions: By id, in the file's order.
        revision: As declared, e.g. ``1.4``; only informative.
        geo_reference: PROJ string or WKT, empty if there is none.
        offset: Header offset (x, y, z, heading) as in the file. All coordinates are turned by the
            heading already; only the translation is left to their users.
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
