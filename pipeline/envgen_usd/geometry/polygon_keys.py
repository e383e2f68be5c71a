"""Equality of polygons, whatever the first point of their rings is."""

from typing import TypeAlias

from envgen_usd.geometry.flat_arrays import turned
from envgen_usd.models.polygon_arrays import Polygons

_Ring: TypeAlias = tuple[tuple[float, ...], ...]
PolygonKey: TypeAlias = tuple[_Ring, ...]
"""Equal for polygons with equal rings in the same direction."""


def polygon_keys(polygons: Polygons) -> list[PolygonKey]:
    """Returns a key for each polygon, P; holes in any order give the same key."""
    keys = []
    for polygon in range(len(polygons)):
        exterior, *holes = (
            _from_least(list(map(tuple, ring.tolist()))) for ring in polygons.rings(polygon)
        )
        keys.append((exterior, *sorted(holes)))
    return keys


def opposite_keys(polygons: Polygons) -> list[PolygonKey]:
    """Returns the key of each polygon with the opposite direction, P."""
    return polygon_keys(turned(polygons))


def _from_least(ring: list[tuple[float, ...]]) -> _Ring:
    start = ring.index(min(ring)) if ring else 0
    return (*ring[start:], *ring[:start])
