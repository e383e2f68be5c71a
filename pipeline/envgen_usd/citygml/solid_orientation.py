"""Reorients solids of other programs whose faces point inwards."""

from collections.abc import Container, Iterable, Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.flat_arrays import join, take, turned
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.iso19107.shell_faults import volumes
from envgen_usd.geometry.polygon_keys import PolygonKey, polygon_keys
from envgen_usd.models.array_types import BoolArray
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons, Solids

_INSIDE_OUT = 405
_LEAST_FACES = 4
"""Faces of a closed shell; a larger value leaves more small shells as they are."""


def face_outwards(feature: CityObject) -> tuple[CityObject, tuple[Issue, ...]]:
    """Returns a feature with outward-facing closed shells, and an issue for each reoriented shell.

    A shell is that of a geometry without semantics, or all surfaces of the solid's level of
    detail. Faces of cavities point into the cavity. Shells with any other fault are left as they
    are, because their interior is undefined. Surfaces turn with the equal polygons of a solid.

    Args:
        feature: Feature with all its parts.
    """
    parts = [face_outwards(child) for child in feature.children]
    inner = [issue for _, issues in parts for issue in issues]
    geometry, surfaces = dict(feature.geometry), feature.surfaces
    wrong = []
    for name, shape in feature.geometry.items():
        inside_out = _inside_out(name, shape)
        if inside_out.any():
            wrong.append(name)
            geometry[name] = turned(shape, inside_out)
            members = take(shape, np.flatnonzero(inside_out))
            keys = set(polygon_keys(members)) if name.endswith("Solid") else set()
            surfaces = tuple(_turned(surface, int(name[3]), keys) for surface in surfaces)
    shell = [s for s in _flat(surfaces) if s.lod == feature.solid_lod]
    if _inside_out("Solid", join([surface.polygons for surface in shell])).any():
        wrong.append(f"lod{feature.solid_lod}Solid")
        surfaces = tuple(_turned(surface, feature.solid_lod) for surface in surfaces)
    faced = replace(
        feature,
        geometry=geometry,
        surfaces=surfaces,
        children=tuple(child for child, _ in parts),
    )
    return faced, (*inner, *(_issue(feature, name) for name in wrong))


def _inside_out(name: str, shape: Polygons) -> BoolArray:
    """P, true for polygons of shells whose only fault is that they face the wrong side."""
    none = np.zeros(len(shape), dtype=bool)
    if not name.endswith(("Solid", "MultiSurface")) or len(shape) < _LEAST_FACES:
        return none
    if isinstance(shape, Solids):
        bodies = Bodies(shape, shape.shell, shape.solid)
    else:
        bodies = Bodies.of_solid(shape)
    outer = np.ones(len(bodies.solid), dtype=bool)
    outer[1:] = bodies.solid[1:] != bodies.solid[:-1]
    if (volumes(shape, bodies.shell) * np.where(outer, 1.0, -1.0) >= 0.0).all():
        return none
    faults = find_faults(bodies)
    if {fault.code for fault in faults} != {_INSIDE_OUT}:
        return none
    return np.isin(bodies.shell, [fault.shell for fault in faults])


def _flat(surfaces: Iterable[ThematicSurface]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _flat(surface.openings)


def _turned(
    surface: ThematicSurface, lod: int, keys: Container[PolygonKey] | None = None
) -> ThematicSurface:
    """A surface with reversed polygons at a level of detail: all, or those with the keys."""
    openings = tuple(_turned(opening, lod, keys) for opening in surface.openings)
    shape = surface.polygons
    if surface.lod == lod and keys is None:
        shape = turned(shape)
    elif surface.lod == lod and keys:
        shape = turned(shape, np.array([key in keys for key in polygon_keys(shape)], dtype=bool))
    return replace(surface, polygons=shape, openings=openings)


def _issue(feature: CityObject, name: str) -> Issue:
    where = f"{feature.kind}[{feature.id}]"
    text = f"all faces of {name} point inwards"
    return Issue(f"iso19107.{_INSIDE_OUT}", Severity.WARNING, where, text, "turned")
