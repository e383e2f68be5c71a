"""What the road file says about parking, for a whole map."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.kept_records import Record
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import LaneLine, RoadLine, RoadSurface
from envgen_usd.models.signals import Signal

LaneKey = tuple[str, int, int]
"""Road, index of the section, lane."""
_NO_STOPPING = frozenset({"283", "286"})
"""German codes (StVO, annex 2) of the signs against stopping and parking."""
_CAR = "passengerCar"


@dataclass(frozen=True)
class StreetFacts:
    """Lanes, crossings, bays and signals of a map.

    Attributes:
        sections: All lanes of a section of a road, by road and index of the section.
        roads: Reference lines by road.
        in_junctions: Ids of the lanes within junctions.
        solid: Roads and sections with a solid centre line.
        banned: Lanes on which the file forbids parking.
        crossings: Crosswalks: each the corners of its smallest rectangle, 4 x 3, metres.
        bays: Parking spaces by id: each the corners of its smallest rectangle, 4 x 3, metres.
        lights: N x 2, traffic lights.
        no_stopping: N x 2, signs against stopping and parking.
    """

    sections: Mapping[tuple[str, int], tuple[LaneLine, ...]]
    roads: Mapping[str, RoadLine]
    in_junctions: frozenset[str]
    solid: frozenset[tuple[str, int]]
    banned: frozenset[LaneKey]
    crossings: tuple[FloatArray, ...]
    bays: Mapping[str, FloatArray]
    lights: FloatArray
    no_stopping: FloatArray

    @staticmethod
    def of(surface: RoadSurface, network: RoadNetwork) -> "StreetFacts":
        """Returns the facts of a map.

        Args:
            surface: All roads.
            network: Their file, which knows of the rules of lanes.
        """
        lanes = sorted(surface.lanes, key=lambda lane: (lane.road, lane.section, lane.lane))
        sections = {
            key: tuple(members)
            for key, members in groupby(lanes, key=lambda lane: (lane.road, lane.section))
        }
        solid = {
            (patch.road, patch.section)
            for patch in surface.patches
            if patch.kind == "mark" and patch.lane == 0 and "solid" in patch.mark_type
        }
        signals = [f for f in surface.features if isinstance(f.source, Signal)]
        lights = [f.plan()[0] for f in signals if f.template == "traffic_light"]
        signs = [f.plan()[0] for f in signals if _forbids_parking(f.source)]
        return StreetFacts(
            sections,
            {line.road: line for line in surface.roads},
            frozenset(lane.id for lane in surface.lanes if lane.junction),
            frozenset(solid),
            frozenset(_banned_lanes(network)),
            tuple(_rectangles(surface, "crosswalk").values()),
            _rectangles(surface, "parking"),
            np.array(lights).reshape(-1, 2),
            np.array(signs).reshape(-1, 2),
        )


def _forbids_parking(signal: object) -> bool:
    if not isinstance(signal, Signal):
        return False
    return signal.country.upper() in {"DE", "DEU", "GERMANY"} and signal.type in _NO_STOPPING


def _banned_lanes(network: RoadNetwork) -> Iterator[LaneKey]:
    """Lanes with a rule against stopping or parking, or without access for cars (11.8)."""
    for road in network.roads.values():
        for number, section in enumerate(road.sections):
            for lane in (*section.left, *section.right):
                if any(_bans(record) for record in lane.extra):
                    yield road.id, number, lane.id


def _bans(record: Record) -> bool:
    values = record.attributes
    if record.tag == "rule":
        text = values.get("value", "").lower()
        return "no stopping" in text or "no parking" in text
    if record.tag != "access":
        return False
    named = {
        values.get("restriction", ""),
        *(c.attributes.get("type", "") for c in record.children),
    }
    return (values.get("rule", "deny") == "allow") != (_CAR in named)


def _rectangles(surface: RoadSurface, kind: str) -> dict[str, FloatArray]:
    """Smallest rectangle around each patch of a kind, 4 x 3, by the patch's id."""
    wanted = np.array([patch.kind == kind for patch in surface.patches], dtype=bool)
    rows = np.flatnonzero(wanted[surface.triangle_patch]) if wanted.any() else np.empty(0, int)
    rows = rows[np.argsort(surface.triangle_patch[rows], kind="stable")]
    owners, starts = np.unique(surface.triangle_patch[rows], return_index=True)
    rectangles = {}
    for owner, group in zip(owners.tolist(), np.split(rows, starts)[1:], strict=True):
        points = surface.vertices[np.unique(surface.triangles[group])]
        shape = shapely.MultiPoint(points[:, :2]).minimum_rotated_rectangle
        if isinstance(shape, shapely.Polygon):
            corners = shapely.get_coordinates(shape)[:4]
            height = np.full((4, 1), points[:, 2].mean())
            rectangles[surface.patches[owner].id] = np.hstack([corners, height])
    return rectangles
