"""Turns buildings of several separate solids into buildings with parts.

CityGML and CityJSON represent separate solids (MultiSolid) of a building as building parts.
"""

from collections.abc import Container, Iterable, Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.geometry.flat_arrays import split_solids, take
from envgen_usd.geometry.polygon_keys import PolygonKey, polygon_keys
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons, Solids


def with_parts(building: CityObject) -> CityObject:
    """Returns a building with a part for each of its separate solids; others are unchanged.

    The surfaces of a solid go to its part. A part of several solids becomes several parts.

    Args:
        building: Feature with all its parts, with classified surfaces.
    """
    if building.kind != "Building":
        return building
    children = [part for child in building.children for part in _parts(child)]
    roles = _separate(building)
    if not roles:
        return replace(building, children=tuple(children))
    parts = list(_split(building, roles))
    inside = {key for role in roles for key in polygon_keys(building.geometry[role])}
    levels = {int(role[3]) for role in roles}
    return replace(
        building,
        surfaces=tuple(_outside(building.surfaces, levels, inside)),
        geometry={name: p for name, p in building.geometry.items() if name not in roles},
        children=(*parts, *children),
    )


def _parts(child: CityObject) -> Iterator[CityObject]:
    roles = _separate(child) if child.kind == "BuildingPart" else []
    if roles:
        yield from (replace(p, attributes=child.attributes) for p in _split(child, roles))
    else:
        yield child


def _separate(feature: CityObject) -> list[str]:
    """Properties with separate solids, as many as in the finest of them; the finest first."""
    counts = {
        name: len(split_solids(shape))
        for name, shape in feature.geometry.items()
        if isinstance(shape, Solids) and not shape.composite
    }
    several = sorted((name for name, count in counts.items() if count > 1), reverse=True)
    return [name for name in several if counts[name] == counts[several[0]]]


def _split(feature: CityObject, roles: list[str]) -> Iterator[CityObject]:
    """A part for each solid, with the surfaces that bound it."""
    solids = zip(*(split_solids(feature.geometry[role]) for role in roles), strict=True)
    for number, members in enumerate(solids):
        geometry = dict(zip(roles, members, strict=True))
        surfaces: list[ThematicSurface] = []
        for role, solid in geometry.items():
            keys = set(polygon_keys(solid))
            surfaces += _within(feature.surfaces, int(role[3]), keys, f"_{number}")
        part = CityObject(
            f"{feature.id}_solid_{number}",
            "BuildingPart",
            surfaces=tuple(surfaces),
            geometry=geometry,
        )
        yield _bounded(part, roles[0])


def _bounded(part: CityObject, role: str) -> CityObject:
    """A part whose solid consists of its surfaces, if these are its only shell."""
    solid, lod = part.geometry[role], int(role[3])
    count = sum(len(surface.polygons) for surface in _flat(part.surfaces) if surface.lod == lod)
    if isinstance(solid, Solids) or count != len(solid):
        return part
    rest = {name: shape for name, shape in part.geometry.items() if name != role}
    return replace(part, geometry=rest, solid_lod=lod)


def _flat(surfaces: Iterable[ThematicSurface]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _flat(surface.openings)


def _within(
    surfaces: Iterable[ThematicSurface], lod: int, keys: Container[PolygonKey], suffix: str
) -> Iterator[ThematicSurface]:
    """Surfaces of a level of detail, with those polygons that have the keys."""
    for surface in surfaces:
        openings = tuple(_within(surface.openings, lod, keys, suffix))
        polygons = _chosen(surface.polygons, keys, inside=True)
        if surface.lod == lod and (len(polygons) or openings):
            name = f"{surface.id}{suffix}"
            yield replace(surface, id=name, polygons=polygons, openings=openings)


def _outside(
    surfaces: Iterable[ThematicSurface], levels: Container[int], keys: Container[PolygonKey]
) -> Iterator[ThematicSurface]:
    """Surfaces with those polygons that do not have the keys."""
    for surface in surfaces:
        openings = tuple(_outside(surface.openings, levels, keys))
        polygons = _chosen(surface.polygons, keys, inside=False)
        if surface.lod not in levels:
            yield surface
        elif len(polygons) or openings:
            yield replace(surface, polygons=polygons, openings=openings)


def _chosen(polygons: Polygons, keys: Container[PolygonKey], *, inside: bool) -> Polygons:
    chosen = [n for n, key in enumerate(polygon_keys(polygons)) if (key in keys) == inside]
    return take(polygons, np.array(chosen, dtype=np.int64))
