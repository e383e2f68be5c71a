"""A city in the frame of another."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pyproj
from pyproj.exceptions import CRSError, ProjError

from envgen_usd.chunks import snap
from envgen_usd.errors import EnvgenError
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import City, CityObject, ThematicSurface
from envgen_usd.models.polygons import Polygons

_Place = Callable[[FloatArray], FloatArray]


def moved(city: City, crs: str, offset: tuple[float, float, float]) -> City:
    """Returns a city with another CRS and offset; heights only change by the offsets.

    Args:
        city: Any city.
        crs: CRS of the result; without one, or without one of the city, only offsets are applied,
            as they are where one of the two is not metric.
        offset: Offset of the result.

    Raises:
        EnvgenError: One is no CRS, or no way leads from one to the other.
    """
    way = _way(city.crs, crs)
    before, after = np.array(city.offset), np.array(offset)
    if way is None and (before == after).all():
        return replace(city, crs=crs or city.crs)

    def place(points: FloatArray) -> FloatArray:
        found = points + before
        if way is not None and len(points):
            x, y = way.transform(found[:, 0], found[:, 1])
            found = np.column_stack([x, y, found[:, 2]])
        return snap(found - after)

    objects = tuple(_object(thing, place) for thing in city.objects)
    return City(objects, crs or city.crs, offset, city.issues)


def _way(source: str, target: str) -> pyproj.Transformer | None:
    """How coordinates are transformed; none where they stay."""
    if not source or not target or source == target:
        return None
    try:
        one, two = pyproj.CRS(source), pyproj.CRS(target)
        if one == two or not (one.is_projected and two.is_projected):
            return None
        return pyproj.Transformer.from_crs(one, two, always_xy=True)
    except (CRSError, ProjError) as error:
        raise EnvgenError(f"no way leads from the CRS {source} to {target}: {error}") from error


def _object(thing: CityObject, place: _Place) -> CityObject:
    placement = thing.placement
    if placement is not None:
        placement = replace(placement, position=place(placement.position.reshape(1, 3))[0])
    return replace(
        thing,
        surfaces=tuple(_surface(surface, place) for surface in thing.surfaces),
        geometry={name: _shape(shape, place) for name, shape in thing.geometry.items()},
        curves={name: tuple(map(place, lines)) for name, lines in thing.curves.items()},
        placement=placement,
        children=tuple(_object(child, place) for child in thing.children),
    )


def _surface(surface: ThematicSurface, place: _Place) -> ThematicSurface:
    openings = tuple(_surface(opening, place) for opening in surface.openings)
    return replace(surface, polygons=_shape(surface.polygons, place), openings=openings)


def _shape(shape: Polygons, place: _Place) -> Polygons:
    return replace(shape, points=place(shape.points))
