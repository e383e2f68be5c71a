"""Built form of lanes with an ambiguous type in the file."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import RoadNetwork

_WIDEST_KERB = 0.6
"""Widest kerb in metres; the corpus has kerbs up to 0.5 m and banks from 0.8 m."""
_BESIDE_TRAFFIC = frozenset(
    ("none", "shoulder", "sidewalk", "walking", "border", "curb", "median", "parking")
)


def built_lanes(section: LaneSection) -> tuple[Lane, ...]:
    """Returns the lanes from left to right, without the centre lane.

    A narrow lane of type ``border`` is a kerb and becomes ``curb``; a wide border is land beside
    the road. In a section without traffic lanes, lanes of type ``none`` between the shoulders form
    a closed carriageway and become ``restricted``.
    """
    lanes = [_with_kerb(lane, section) for lane in _lanes(section)]
    for place in _closed(section):
        lanes[place] = replace(lanes[place], type="restricted")
    return tuple(lanes)


def closed_carriageways(network: RoadNetwork) -> Iterator[Issue]:
    """Yields an issue for each road with a closed carriageway."""
    for road in network.roads.values():
        count = sum(len(_closed(section)) for section in road.sections)
        if count:
            yield Issue(
                "road.closed_carriageway",
                Severity.INFO,
                f"road[id={road.id}]/lanes",
                f"{count} lanes of type none between shoulders, no lane for traffic",
                "paved",
            )


def border_kerbs(network: RoadNetwork) -> Iterator[Issue]:
    """Yields an issue for each road whose narrow lanes of type ``border`` become kerbs."""
    for road in network.roads.values():
        count = sum(
            _is_kerb(lane, section) for section in road.sections for lane in _lanes(section)
        )
        if count:
            yield Issue(
                "road.border_kerb",
                Severity.INFO,
                f"road[id={road.id}]/lanes",
                f"{count} lanes of type border are at most {_WIDEST_KERB:g} m wide",
                "built as kerb stones",
            )


def _lanes(section: LaneSection) -> list[Lane]:
    return [*reversed(section.left), *section.right]


def _with_kerb(lane: Lane, section: LaneSection) -> Lane:
    return replace(lane, type="curb") if _is_kerb(lane, section) else lane


def _is_kerb(lane: Lane, section: LaneSection) -> bool:
    if lane.type != "border" or not len(lane.width.start):
        return False
    places = np.append(lane.width.start, section.end - section.s)
    return bool(0.0 < lane.width(places).max() <= _WIDEST_KERB)


def _closed(section: LaneSection) -> list[int]:
    """Returns the indices, from left to right, of the lanes of a closed carriageway."""
    types = [lane.type for lane in _lanes(section)]
    shoulders = [place for place, kind in enumerate(types) if kind == "shoulder"]
    if len(shoulders) < 2 or not _BESIDE_TRAFFIC.issuperset(types):
        return []
    between = range(shoulders[0], shoulders[-1])
    return [place for place in between if types[place] == "none"]
