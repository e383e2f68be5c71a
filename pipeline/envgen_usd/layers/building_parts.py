"""Selects constructions and what is drawn of them; names and places their prims."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.assets.prim_authoring import prim_names
from envgen_usd.chunks import Chunk, snap
from envgen_usd.layers.payload_files import local
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

CLASSES = {
    "Building": "building",
    "OtherConstruction": "building",
    "Bridge": "bridge",
    "Tunnel": "tunnel",
}
"""Token in the `class` taxonomy of each kind of construction."""


def buildings_by_name(city: City) -> dict[str, CityObject]:
    """Returns the top-level constructions that have a geometry, by prim name.

    The buildings layer and the props layer get the same names without reading each other's files.
    """
    tops = {top.id: top for top in city.objects if top.kind in CLASSES and _has_shell(top)}
    return {name: tops[key] for key, name in prim_names(tops).items()}


def _has_shell(building: CityObject) -> bool:
    return next(shell_polygons(building), None) is not None


def shell_polygons(building: CityObject) -> Iterator[tuple[ThematicSurface | None, Polygons]]:
    """The most detailed polygons of a building and its parts.

    Yields:
        Surface of the polygons, or `None` for geometry without semantics; and the polygons.
    """
    for part in building.walk():
        surfaces = [s for s in with_openings(part.surfaces) if len(s.polygons)]
        finest = max((surface.lod for surface in surfaces), default=-1)
        for surface in surfaces:
            if surface.lod == finest:
                yield surface, surface.polygons
        if not surfaces:
            names = sorted(name for name in part.geometry if name.startswith("lod"))
            if names and len(part.geometry[names[-1]]):
                yield None, part.geometry[names[-1]]


def with_openings(surfaces: tuple[ThematicSurface, ...]) -> Iterator[ThematicSurface]:
    """Surfaces, each followed by its windows and doors."""
    for surface in surfaces:
        yield surface
        yield from with_openings(surface.openings)


def building_pivot(building: CityObject, chunk: Chunk) -> FloatArray:
    """Origin of a building's prim in the chunk's frame: 3, metres; below its middle.

    It lies on the grid, so that welding keeps vertices apart that differ by a grid step.
    """
    points = np.concatenate([polygons.points for _, polygons in shell_polygons(building)])
    box = local(np.stack([points.min(axis=0), points.max(axis=0)]), chunk)
    return snap(np.array([*box.mean(axis=0)[:2], box[0, 2]]))
