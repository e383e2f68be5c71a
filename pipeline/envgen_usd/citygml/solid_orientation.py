"""Reorients solids of other programs whose faces point inwards."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.flat_arrays import join, turned
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.iso19107.shell_faults import volumes
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

_INSIDE_OUT = 405


def face_outwards(feature: CityObject) -> tuple[CityObject, tuple[Issue, ...]]:
    """Returns a feature with outward-facing closed shells, and an issue for each reoriented shell.

    A shell is the polygons of a geometry without semantics, or all surfaces of the solid's level of
    detail. Shells with any other fault are left as they are, because their interior is undefined.

    Args:
        feature: Feature with all its parts.
    """
    parts = [face_outwards(child) for child in feature.children]
    inner = [issue for _, issues in parts for issue in issues]
    wrong = [name for name, shape in feature.geometry.items() if _is_inside_out(name, shape)]
    geometry = {
        name: turned(shape) if name in wrong else shape for name, shape in feature.geometry.items()
    }
    shell = [s for s in _flat(feature.surfaces) if s.lod == feature.solid_lod]
    surfaces = feature.surfaces
    if _is_inside_out("Solid", join([surface.polygons for surface in shell])):
        wrong.append(f"lod{feature.solid_lod}Solid")
        surfaces = tuple(_turned(surface, feature.solid_lod) for surface in surfaces)
    faced = replace(
        feature,
        geometry=geometry,
        surfaces=surfaces,
        children=tuple(child for child, _ in parts),
    )
    return faced, (*inner, *(_issue(feature, name) for name in wrong))


def _is_inside_out(name: str, shape: Polygons) -> bool:
    if not name.endswith(("Solid", "MultiSurface")) or len(shape) < 4:
        return False
    if volumes(shape, np.zeros(len(shape), dtype=np.int64))[0] >= 0.0:
        return False
    return {fault.code for fault in find_faults(Bodies.of_solid(shape))} == {_INSIDE_OUT}


def _flat(surfaces: Iterable[ThematicSurface]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _flat(surface.openings)


def _turned(surface: ThematicSurface, lod: int) -> ThematicSurface:
    openings = tuple(_turned(opening, lod) for opening in surface.openings)
    shape = turned(surface.polygons) if surface.lod == lod else surface.polygons
    return replace(surface, polygons=shape, openings=openings)


def _issue(feature: CityObject, name: str) -> Issue:
    where = f"{feature.kind}[{feature.id}]"
    text = f"all faces of {name} point inwards"
    return Issue(f"iso19107.{_INSIDE_OUT}", Severity.WARNING, where, text, "turned")
