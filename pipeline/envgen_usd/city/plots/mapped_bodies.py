"""Bodies of a mapped building: they stand on the same ground, and are parts of one feature."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.city.ground_heights import Ground
from envgen_usd.models.array_types import IntArray
from envgen_usd.models.city_model import CityObject

_STEP = 2.0
"""Distance of the points at which the ground is looked up, metres."""
_SHARED = ("class", "function", "style")
"""Attributes of a building that its parts have, too."""


def ground_below(
    shapes: Sequence[shapely.Polygon], groups: IntArray, ground: Ground
) -> list[tuple[float, float]]:
    """Lowest and highest ground below each footprint; bodies of a group share those of all."""
    if not shapes:
        return []
    edges = shapely.segmentize(np.array(shapes, object), _STEP)
    points, of = shapely.get_coordinates(edges, return_index=True)
    own = np.where(groups >= 0, groups, groups.max(initial=0) + 1 + np.arange(len(groups)))
    _, number = np.unique(own, return_inverse=True)
    heights = ground.heights(points)
    lows, highs = np.full(number.max() + 1, np.inf), np.full(number.max() + 1, -np.inf)
    np.minimum.at(lows, number[of], heights)
    np.maximum.at(highs, number[of], heights)
    return list(zip(lows[number].tolist(), highs[number].tolist(), strict=True))


def grouped(built: Sequence[CityObject], groups: IntArray) -> tuple[CityObject, ...]:
    """Buildings, each with the bodies of its group as parts.

    Args:
        built: A building for each body.
        groups: Group of each; -1 for a building of its own.
    """
    members: dict[int, list[CityObject]] = defaultdict(list)
    for building, group in zip(built, groups.tolist(), strict=True):
        members[group].append(building)
    whole = members.pop(-1, [])
    for group, bodies in sorted(members.items()):
        whole.append(bodies[0] if len(bodies) == 1 else _of_parts(group, bodies))
    return tuple(whole)


def _of_parts(group: int, bodies: Sequence[CityObject]) -> CityObject:
    """A building whose surfaces are those of its parts."""
    parts = tuple(replace(body, kind="BuildingPart") for body in bodies)
    shared = {key: bodies[0].attributes[key] for key in _SHARED if key in bodies[0].attributes}
    return CityObject(f"osm_building_of_parts_{group}", "Building", shared, children=parts)
