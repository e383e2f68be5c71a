"""Smooths heights in junctions where connecting roads disagree."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.opendrive.mesh.junction_plate import Plate
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.strip_index import Cells, Hits

_AGREED = 5e-3
"""Height difference in metres below which connecting roads agree and stay unchanged."""
_AT_ARM = 0.1
"""Metres from an arm within which the arm alone determines the height."""


def smooth_junctions(
    base: FloatArray, points: FloatArray, hits: Hits, strips: Sequence[Strip], cells: Cells
) -> dict[str, float]:
    """Replaces heights in junctions with disagreeing connecting roads, in place.

    The new surface is a thin plate on a grid. It fits all connecting roads and continues into the
    arms, which keep their heights.

    Args:
        base: P, metres, heights without lane heights; changed in place.
        points: P x 2, metres.
        hits: Strips at the points.
        strips: Strips of lanes.
        cells: Spatial index of the strips.

    Returns:
        The largest disagreement in metres by junction id.
    """
    disagreeing = _disagreeing(hits, strips, len(points))
    if not disagreeing:
        return disagreeing
    names = np.array([strip.patch.junction for strip in strips])
    lanes = np.array([strip.patch.kind == "lane" for strip in strips])
    outside = (names == "") & lanes
    free = np.ones(len(points), dtype=bool)
    free[hits.place[outside[hits.strip]]] = False
    for name in sorted(disagreeing):
        members = names == name
        inside = np.zeros(len(points), dtype=bool)
        inside[hits.place[members[hits.strip]]] = True
        place = np.flatnonzero(inside & free)
        plate = Plate([strips[k] for k in np.flatnonzero(members).tolist()])
        height = plate.fit(cells, lanes, members, outside)(points[place])
        near = cells.within(points[place], _AT_ARM)
        at_arm = np.flatnonzero(outside[near.strip])
        height[near.place[at_arm]] = near.base[at_arm]
        known = np.isfinite(height)
        base[place[known]] = height[known]
    return disagreeing


def _disagreeing(hits: Hits, strips: Sequence[Strip], count: int) -> dict[str, float]:
    """Returns the largest height differences of connecting roads by junction, metres."""
    lanes = np.array([bool(s.patch.junction) and s.patch.kind == "lane" for s in strips])
    chosen = np.flatnonzero(lanes[hits.strip])
    place, height = hits.place[chosen], hits.base[chosen]
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, place, height)
    np.maximum.at(high, place, height)
    apart = np.zeros(len(strips))
    np.maximum.at(apart, hits.strip[chosen], (high - low)[place])
    largest: dict[str, float] = {}
    for number in np.flatnonzero(apart > _AGREED).tolist():
        name = strips[number].patch.junction
        largest[name] = max(largest.get(name, 0.0), float(apart[number]))
    return largest
