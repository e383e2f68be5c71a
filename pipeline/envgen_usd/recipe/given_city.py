"""Reads the user's city model, which replaces generated buildings."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.plots.given_buildings import GivenBuildings
from envgen_usd.city.plots.moved_city import moved, shifted
from envgen_usd.city.plots.separate_solids import with_parts
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.solid_orientation import face_outwards
from envgen_usd.citygml.surface_semantics import classify
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.compressed_files import content_suffix
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.georeference import parse_crs
from envgen_usd.models.city_model import City
from envgen_usd.models.road_surface import RoadSurface


def read_given_city(
    path: Path, surface: RoadSurface, chunks: Iterable[Chunk], offset: Sequence[float] = ()
) -> GivenBuildings:
    """Reads the buildings of a file that stand on a map, with issues for faulty features.

    Coordinates are transformed into the road frame by the road's geoReference. Without a metric
    geoReference, road and file have to share their coordinates. The offset moves them further.

    Args:
        path: CityGML 1.0, 2.0 or 3.0, CityJSON (.json) or CityJSONSeq (.jsonl).
        surface: The road.
        chunks: The map; buildings outside are left out.
        offset: Metres to the east, to the north, and upwards; the last may be missing.

    Raises:
        EnvgenError: The file does not exist, is not a city model, or has no building on the map.
    """
    crs = surface.crs if parse_crs(surface.crs) is not None else ""
    shift = np.array([*offset, *([0.0] * (3 - len(offset)))])
    road = surface.vertices + np.array(surface.offset) - shift
    if content_suffix(path) in (".json", ".jsonl"):
        city = _as_from_citygml(read_cityjson(path))
    else:
        city = read_city(path, crs, surface.offset, np.stack([road.min(axis=0), road.max(axis=0)]))
    city = replace(city, objects=tuple(map(with_parts, city.objects)))
    city = moved(city, crs, surface.offset)
    if shift.any():
        city = replace(city, objects=tuple(shifted(each, shift) for each in city.objects))
    given = GivenBuildings(city)
    total = len(given)
    if not total and given.issues:
        raise EnvgenError(f"{path}: has no usable building: {given.issues[0].message}")
    given.keep(chunks)
    given.check()
    if not len(given):
        raise EnvgenError(
            f"{path}: none of its {total} buildings stands on the map; do its coordinates match "
            f"the road's geoReference ({surface.crs or 'none'})? --city-offset X,Y moves them"
        )
    return given


def _as_from_citygml(city: City) -> City:
    """A city with outward-facing solids and classified boundary surfaces."""
    faced = [face_outwards(thing) for thing in city.objects]
    objects = tuple(classify(thing) for thing, _ in faced)
    issues = (issue for _, found in faced for issue in found)
    return replace(city, objects=objects, issues=(*city.issues, *issues))
