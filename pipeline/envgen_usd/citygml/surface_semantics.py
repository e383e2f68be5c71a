"""Classifies the surfaces of foreign buildings as wall, roof and ground."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.geometry.flat_arrays import join, take
from envgen_usd.geometry.polygon_keys import opposite_keys, polygon_keys
from envgen_usd.geometry.polygon_planes import polygon_normals
from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons, Solids

_BUILDINGS = frozenset({"Building", "BuildingPart", "BuildingInstallation"})
_UPRIGHT = 0.17
"""Sine of the largest deviation of a wall from the vertical: 10 degrees.

A larger value classifies more polygons as walls.
"""
_NEAR_GROUND = 0.5
"""Height above a building's lowest point up to which downward faces are ground, metres.

A larger value classifies more faces as ground.
"""
_KINDS = ("WallSurface", "RoofSurface", "GroundSurface", "OuterCeilingSurface")


def classify(feature: CityObject) -> CityObject:
    """Returns a building whose finest polygons all have a class; other features are unchanged.

    Only polygons of the highest level of detail outside all boundary surfaces are classified.
    Polygons within 10 degrees of the vertical are walls, and upward polygons are roofs. Downward
    polygons are ground or outer ceilings. All surfaces of a solid form its shell. Several solids
    and solids with cavities stay beside the surfaces; faces inside of them get no class.

    Args:
        feature: Feature with all its parts.
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
        outer = take(polygons, np.flatnonzero(_outside(polygons)))
        rest = take(outer, _without(outer, known))
        surfaces += _classified(f"{feature.id}_{name}", _level(name), rest, _lowest(polygons))
    several = {name for name in finest if isinstance(feature.geometry[name], Solids)}
    closed = any(name.endswith("Solid") for name in finest) and not several
    return replace(
        feature,
        surfaces=tuple(surfaces),
        geometry={
            name: p for name, p in feature.geometry.items() if name not in finest or name in several
        },
        solid_lod=max(lods) if closed else feature.solid_lod,
        children=children,
    )


def _outside(polygons: Polygons) -> BoolArray:
    """P, true for polygons that bound neither a cavity nor two solids."""
    if not isinstance(polygons, Solids):
        return np.ones(len(polygons), dtype=bool)
    keys = set(polygon_keys(polygons))
    shared = np.array([key in keys for key in opposite_keys(polygons)], dtype=bool)
    outside: BoolArray = polygons.exterior & ~shared
    return outside


def _level(name: str) -> int:
    """Level of detail of a property with polygons, 0 for other properties."""
    return int(name[3]) if name[4:] in ("Solid", "MultiSurface") else 0


def _flat(surfaces: list[ThematicSurface]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _flat(list(surface.openings))


def _lowest(polygons: Polygons) -> float:
    return float(polygons.points[:, 2].min()) if len(polygons) else 0.0


def _without(polygons: Polygons, known: list[Polygons]) -> IntArray:
    """Polygons that are not among others; the order of points does not matter."""
    others = join(known)
    taken = {_key(others, p) for p in range(len(others))}
    left = [p for p in range(len(polygons)) if _key(polygons, p) not in taken]
    return np.array(left, dtype=np.int64)


def _key(polygons: Polygons, polygon: int) -> frozenset[tuple[float, ...]]:
    return frozenset(tuple(point) for ring in polygons.rings(polygon) for point in ring.tolist())


def _classified(
    name: str, lod: int, polygons: Polygons, lowest: float
) -> Iterator[ThematicSurface]:
    """A surface for each class that occurs."""
    up = polygon_normals(polygons)[:, 2]
    starts = polygons.ring_offsets[polygons.polygon_offsets[:-1]]
    foot = np.minimum.reduceat(polygons.points[:, 2], starts) if len(polygons) else np.empty(0)
    down = np.where(foot < lowest + _NEAR_GROUND, 2, 3)
    kinds = np.where(up > _UPRIGHT, 1, np.where(up < -_UPRIGHT, down, 0))
    for kind in np.unique(kinds).tolist():
        members = take(polygons, np.flatnonzero(kinds == kind))
        yield ThematicSurface(f"{name}_{_KINDS[kind]}", _KINDS[kind], members, lod)
