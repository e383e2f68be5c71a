"""Lanes that a signal applies to, and its dependencies (14.2 to 14.4)."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from envgen_usd.models.kept_records import Record
from envgen_usd.models.lanes import DRIVEN, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.models.road_feature import SignalRelations
from envgen_usd.models.road_objects import Origin
from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.lanes.lane_lines import travels_forward
from envgen_usd.opendrive.surface_ids import lane_patch_id, origin_id


def signal_origin(road: Road, number: int) -> Origin:
    """Returns the origin of what shows a signal."""
    return Origin(road.id, "signal", number, road.signals[number].id)


def signal_paint_id(origin: Origin) -> str:
    """Returns the patch id of a painted signal."""
    return f"{origin_id(origin)}_paint"


def signal_relations(roads: Mapping[str, Road]) -> dict[str, SignalRelations]:
    """Returns the relations of signals by their feature ids.

    A signal applies to lanes at its road and at its signalReferences. These are the lanes of its
    validity; without validity, the vehicle lanes with traffic in its orientation. The result may
    contain ids of lanes, features and patches that do not exist; callers filter them.

    Args:
        roads: Roads by id.
    """
    places: dict[str, list[tuple[str, int]]] = {}
    for road in roads.values():
        for number, signal in enumerate(road.signals):
            if not signal.reference:
                places.setdefault(signal.id, []).append((road.id, number))
    held: dict[tuple[str, int], list[str]] = {}
    for road in roads.values():
        for number, signal in enumerate(road.signals):
            place = (road.id, number)
            if signal.reference:
                place = _nearest(places.get(signal.reference, ()), road.id) or place
            held.setdefault(place, []).extend(_lanes_held(road, signal))
    return {
        origin_id(signal_origin(road, number)): SignalRelations(
            tuple(dict.fromkeys(held[road.id, number])),
            tuple(_dependencies(roads, places, road, signal)),
        )
        for road in roads.values()
        for number, signal in enumerate(road.signals)
        if not signal.reference
    }


def _nearest(places: Iterable[tuple[str, int]], road: str) -> tuple[str, int] | None:
    """Returns the signal on a road, or else the first; older files number signals per road."""
    return min(places, key=lambda place: place[0] != road, default=None)


def _lanes_held(road: Road, signal: Signal) -> Iterator[str]:
    index, section = _section_at(road, signal.s)
    if section is None:
        return
    ranges = [_lane_range(each) for each in signal.extra if each.tag == "validity"]
    for lane in (*section.left, *section.right):
        forward = travels_forward(road, lane)
        meant = {"+": forward, "-": not forward}.get(signal.orientation, True)
        listed = any(low <= lane.id <= high for low, high in ranges)
        if listed if ranges else meant and lane.type in DRIVEN:
            yield lane_patch_id(road.id, index, lane.id)


def _section_at(road: Road, s: float) -> tuple[int, LaneSection | None]:
    starts = np.array([section.s for section in road.sections])
    index = max(int(np.searchsorted(starts, s, side="right")) - 1, 0)
    return index, road.sections[index] if road.sections else None


def _lane_range(validity: Record) -> tuple[float, float]:
    first, last = (read(validity.attributes.get(key, "")) for key in ("fromLane", "toLane"))
    ends = [end for end in (first, last) if end is not None]
    return (min(ends), max(ends)) if ends else (1.0, 0.0)


def _dependencies(
    roads: Mapping[str, Road],
    places: Mapping[str, list[tuple[str, int]]],
    road: Road,
    signal: Signal,
) -> Iterator[str]:
    for record in signal.extra:
        wanted = record.attributes.get("id", "") if record.tag == "dependency" else ""
        place = _nearest(places.get(wanted, ()), road.id)
        if place is not None:
            origin = signal_origin(roads[place[0]], place[1])
            yield origin_id(origin)
            yield signal_paint_id(origin)
