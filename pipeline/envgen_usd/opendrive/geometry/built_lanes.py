"""Built form of lanes whose type leaves open what is there."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import RoadNetwork

_WIDEST_STRIP = 0.6
"""Widest paved border in metres; the corpus has such up to 0.5 m and banks from 0.8 m."""
_FLUSH = 0.01
"""Largest height of a border in metres that is level with the lane beside it."""
_BESIDE_CARRIAGEWAYS = frozenset(("none", "sidewalk", "walking", "border", "curb", "median"))
_BESIDE_TRAFFIC = _BESIDE_CARRIAGEWAYS | {"shoulder", "parking"}
_WIDEST_LAND = 4.0
"""Widest outermost lane of type ``none``, metres, that is road as a whole. In junctions such lanes
may continue sidewalks and shoulders, and are then paved; CARLA has some of 3.5 m."""
_STRIP_OF_LAND = 2.0
"""Metres of a wider one that belong to the road."""


def built_lanes(section: LaneSection) -> tuple[Lane, ...]:
    """Returns the lanes from left to right, without the centre lane.

    A wide lane of type ``border`` is land beside the road. A narrow one is paved: level with the
    carriageway beside it, it is its edge strip and becomes ``shoulder`` (ASAM's Ex_Crosswalk has
    one below its raised curb); raised or elsewhere, it becomes ``curb``. In a section without
    traffic lanes, lanes of type ``none`` between the shoulders form a closed carriageway and become
    ``restricted``.
    """
    lanes = _lanes(section)
    for place, kind in _paved_borders(section).items():
        lanes[place] = replace(lanes[place], type=kind)
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


def paved_borders(network: RoadNetwork) -> Iterator[Issue]:
    """Yields an issue for each road whose narrow lanes of type ``border`` are paved."""
    for road in network.roads.values():
        kinds = [kind for section in road.sections for kind in _paved_borders(section).values()]
        if kinds:
            yield Issue(
                "road.paved_border",
                Severity.INFO,
                f"road[id={road.id}]/lanes",
                f"{len(kinds)} lanes of type border are at most {_WIDEST_STRIP:g} m wide",
                f"{kinds.count('shoulder')} are edge strips of the carriageway, "
                f"{kinds.count('curb')} kerb stones",
            )


def widest_lanes(section: LaneSection, lanes: Sequence[Lane]) -> list[float]:
    """Returns up to which width each lane of a side is built, from the centre outwards, metres.

    By the standard the outermost lane of type ``none`` has no content: it says that a vehicle there
    is still in the file's road. Files have such lanes of 20 m, on which houses, fields and trees
    would be missing, so most of a wide one is land.
    """
    widest = [np.inf] * len(lanes)
    if lanes and _land_width(section, lanes[-1]) > _WIDEST_LAND:
        widest[-1] = _STRIP_OF_LAND
    return widest


def land_in_lanes(network: RoadNetwork) -> Iterator[Issue]:
    """Yields an issue for each road with an outermost lane of type ``none`` that is cut."""
    for road in network.roads.values():
        widths = [
            _land_width(section, lanes[-1])
            for section in road.sections
            for lanes in (section.left, section.right)
            if lanes
        ]
        cut = [width for width in widths if width > _WIDEST_LAND]
        if cut:
            yield Issue(
                "road.land_in_lane",
                Severity.INFO,
                f"road[id={road.id}]/lanes",
                f"{len(cut)} outermost lanes of type none are up to {max(cut):.1f} m wide",
                f"only the {_STRIP_OF_LAND:g} m beside the other lanes are road",
            )


def _land_width(section: LaneSection, lane: Lane) -> float:
    """Returns the largest width of a lane of type ``none``; 0 for others."""
    if lane.type != "none" or not len(lane.width.start):
        return 0.0
    places = np.append(lane.width.start, section.end - section.s)
    return float(lane.width(places).max())


def _lanes(section: LaneSection) -> list[Lane]:
    return [*reversed(section.left), *section.right]


def _paved_borders(section: LaneSection) -> dict[int, str]:
    """Built types of narrow borders, by their index from left to right."""
    lanes, types = _lanes(section), {}
    for place, lane in enumerate(lanes):
        if _is_narrow_border(lane, section):
            beside = {other.type for other in lanes[max(place - 1, 0) : place + 2]}
            level = np.abs(lane.height[:, 1:]).max(initial=0.0) <= _FLUSH
            types[place] = "shoulder" if level and beside - _BESIDE_CARRIAGEWAYS else "curb"
    return types


def _is_narrow_border(lane: Lane, section: LaneSection) -> bool:
    if lane.type != "border" or not len(lane.width.start):
        return False
    places = np.append(lane.width.start, section.end - section.s)
    return bool(0.0 < lane.width(places).max() <= _WIDEST_STRIP)


def _closed(section: LaneSection) -> list[int]:
    """Returns the indices, from left to right, of the lanes of a closed carriageway."""
    types = [lane.type for lane in _lanes(section)]
    shoulders = [place for place, kind in enumerate(types) if kind == "shoulder"]
    if len(shoulders) < 2 or not _BESIDE_TRAFFIC.issuperset(types):
        return []
    between = range(shoulders[0], shoulders[-1])
    return [place for place in between if types[place] == "none"]
