"""Transforms a city to the frame of another, and moves features."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pyproj

from envgen_usd.chunks import snap
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.georeference import plan_crs, transformation
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

_Place = Callable[[FloatArray], FloatArray]


def moved(city: City, crs: str, offset: tuple[float, float, float]) -> City:
    """Returns a city with another CRS and offset; heights only change by the offsets.

    Args:
        city: City to transform, in metres.
        crs: Target CRS; if either CRS is missing, only offsets are applied.
        offset: Target offset.

    Raises:
        EnvgenError: A CRS is invalid, or no transformation exists between them.
    """
    way = _way(city.crs, crs)
    before, after = np.array(city.offset), np.array(offset)
    if way is None and (before == after).all():
        return replace(city, crs=crs or city.crs)

    def place(points: FloatArray) -> FloatArray:
        placed = points + before
        if way is not None and len(points):
            x, y = way.transform(placed[:, 0], placed[:, 1])
            placed = np.column_stack([x, y, placed[:, 2]])
        return snap(placed - after)

    objects = tuple(_object(thing, place) for thing in city.objects)
    return City(objects, crs or city.crs, offset, city.issues)


def shifted(feature: CityObject, shift: FloatArray) -> CityObject:
    """Returns a feature with all its parts, moved by a vector (3, metres)."""
    return _object(feature, lambda points: snap(points + shift))


def _way(source: str, target: str) -> pyproj.Transformer | None:
    """Coordinate transformation, or `None` for unchanged coordinates."""
    if not source or not target or source == target:
        return None
    systems = [plan_crs(text) for text in (source, target)]
    for text, system in zip((source, target), systems, strict=True):
        if system is None:
            raise EnvgenError(f"PROJ knows no reference system of places '{text}'")
    source_crs, target_crs = (system for system in systems if system is not None)
    return None if source_crs == target_crs else transformation(source_crs, target_crs)


def _object(feature: CityObject, place: _Place) -> CityObject:
    placement = feature.placement
    if placement is not None:
        placement = replace(placement, position=place(placement.position.reshape(1, 3))[0])
    return replace(
        feature,
        surfaces=tuple(_surface(surface, place) for surface in feature.surfaces),
        geometry={name: _shape(shape, place) for name, shape in feature.geometry.items()},
        curves={name: tuple(map(place, lines)) for name, lines in feature.curves.items()},
        placement=placement,
        children=tuple(_object(child, place) for child in feature.children),
    )


def _surface(surface: ThematicSurface, place: _Place) -> ThematicSurface:
    openings = tuple(_surface(opening, place) for opening in surface.openings)
    return replace(surface, polygons=_shape(surface.polygons, place), openings=openings)


def _shape(shape: Polygons, place: _Place) -> Polygons:
    return replace(shape, points=place(shape.points))
