"""Reads the city model that the user gives in place of generated buildings."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pyproj
from pyproj.exceptions import CRSError

from envgen_usd.chunks import Chunk
from envgen_usd.city.given import GivenBuildings
from envgen_usd.city.moved import moved
from envgen_usd.citygml.orientation import face_outwards
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.semantics import classify
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city import City
from envgen_usd.models.surface import RoadSurface


def read_given_city(path: Path, surface: RoadSurface, chunks: Iterable[Chunk]) -> GivenBuildings:
    """Reads the buildings of a file that stand on a map, with what is wrong with them as issues.

    Coordinates are brought into the frame of the road by its geoReference; a road without one, or
    with one that is not metric, has to lie in the CRS of the file already.

    Args:
        path: CityGML 1.0, 2.0 or 3.0, CityJSON (.json) or CityJSONSeq (.jsonl).
        surface: The road.
        chunks: The map; buildings elsewhere are left out.

    Raises:
        EnvgenError: There is no such file, it is no city model, or none of its buildings stands on
            the map.
    """
    crs = surface.crs if _is_metric(surface.crs) else ""
    if path.suffix.lower() in (".json", ".jsonl"):
        city = _as_from_citygml(read_cityjson(path))
    else:
        city = read_city(path, crs, surface.offset)
    found = GivenBuildings(moved(city, crs, surface.offset))
    total = len(found)
    found.keep(chunks)
    found.check()
    if not len(found):
        raise EnvgenError(
            f"{path}: none of its {total} buildings stands on the map; are its coordinates those"
            f" of the road's geoReference ({surface.crs or 'none'})?"
        )
    return found


def _as_from_citygml(city: City) -> City:
    """A city whose solids face outwards, and whose buildings have classes of surfaces."""
    faced = [face_outwards(thing) for thing in city.objects]
    objects = tuple(classify(thing) for thing, _ in faced)
    issues = (issue for _, found in faced for issue in found)
    return replace(city, objects=objects, issues=(*city.issues, *issues))


def _is_metric(crs: str) -> bool:
    try:
        return bool(crs.strip()) and bool(pyproj.CRS(crs).is_projected)
    except CRSError:
        return False
