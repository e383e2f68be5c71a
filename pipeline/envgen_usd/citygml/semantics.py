"""Wall, roof and ground for buildings of other programs that do not tell them apart."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.geometry.collections import join, take
from envgen_usd.geometry.planes import polygon_normals
from envgen_usd.models.arrays import IntArray
from envgen_usd.models.city import CityObject, ThematicSurface
from envgen_usd.models.polygons import Polygons

_BUILDINGS = frozenset({"Building", "BuildingPart", "BuildingInstallation"})
_UPRIGHT = 0.17
"""Sine of the largest slope of a wall: 10 degrees from the vertical."""
_NEAR_GROUND = 0.5
"""Metres above a building's lowest point below which what looks down is its ground."""
_KINDS = ("WallSurface", "RoofSurface", "GroundSurface", "OuterCeilingSurface")


def classify(feature: CityObject) -> CityObject:
    """Returns a feature whose finest polygons all have a class, where it is a building.

    Polygons of a solid or multi-surface of the highest level of detail that no boundary surface
    has become surfaces: walls where they are upright within 10 degrees, roofs where they look up,
    and ground or outer ceilings where they look down. All surfaces of a solid together are then
    its shell.

    Args:
        feature: With all its parts; what is no building stays as it is.
    """
    children = tuple(classify(child) for child in feature.children)
    roles = [name for name in feature.geometry if _level(name) > 0]
    lods = [*(surface.lod for surface in feature.surfaces), *map(_level, roles)]
    finest = [name for name in roles if _level(name) == max(lods)]
    if feature.kind not in _BUILDINGS or not finest:
        return replace(feature, children=children)
    surfaces = list(feature.surfaces)
    for name in finest:
        polygons = feature.geometry[name]
        known = [s.polygons for s in _flat(surfaces) if s.lod == _level(name)]
        rest = take(polygons, _without(polygons, known))
        surfaces += _classified(f"{feature.id}_{name}", _level(name), rest, _lowest(polygons))
    closed = any(name.endswith("Solid") for name in finest)
    return replace(
        feature,
        surfaces=tuple(surfaces),
        geometry={name: p for name, p in feature.geometry.items() if name not in finest},
        solid_lod=max(lods) if closed else feature.solid_lod,
        children=children,
    )


def _level(name: str) -> int:
    """Level of detail of a property with polygons, 0 for others."""
    return int(name[3]) if name[4:] in ("Solid", "MultiSurface") else 0


def _flat(surfaces: list[ThematicSurface]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _flat(list(surface.openings))


def _lowest(polygons: Polygons) -> float:
    return float(polygons.points[:, 2].min()) if len(polygons) else 0.0


def _without(polygons: Polygons, known: list[Polygons]) -> IntArray:
    """Polygons that are not among others; equal is what has the same points, in whatever order."""
    others = join(known)
    taken = {_key(others, p) for p in range(len(others))}
    left = [p for p in range(len(polygons)) if _key(polygons, p) not in taken]
    return np.array(left, dtype=np.int64)


def _key(polygons: Polygons, polygon: int) -> frozenset[tuple[float, ...]]:
    return frozenset(tuple(point) for ring in polygons.rings(polygon) for point in ring.tolist())


def _classified(
    name: str, lod: int, polygons: Polygons, lowest: float
) -> Iterator[ThematicSurface]:
    """One surface for each class that is there."""
    up = polygon_normals(polygons)[:, 2]
    starts = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    foot = np.minimum.reduceat(polygons.points[:, 2], starts) if len(polygons) else np.empty(0)
    down = np.where(foot < lowest + _NEAR_GROUND, 2, 3)
    kinds = np.where(up > _UPRIGHT, 1, np.where(up < -_UPRIGHT, down, 0))
    for kind in np.unique(kinds).tolist():
        members = take(polygons, np.flatnonzero(kinds == kind))
        yield ThematicSurface(f"{name}_{_KINDS[kind]}", _KINDS[kind], members, lod)
