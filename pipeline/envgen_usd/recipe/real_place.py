"""Reads a real place: an OpenStreetMap extract or a city model."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import shapely

from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.plots.plausible_extent import extent_fault
from envgen_usd.citygml.read import read_city
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.compressed_files import content_suffix
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.models.place import Houses, Place, Streets
from envgen_usd.places.osm_place import read_osm_place

_OSM = (".osm", ".osm.gz", ".osm.bz2", ".pbf")
_CITYJSON = (".json", ".jsonl")
_CITYGML = (".gml", ".xml")
_ROOFS: Mapping[str, str] = {
    "1000": "flat",
    "1010": "shed",
    "1020": "shed",
    "1030": "gabled",
    "1040": "hipped",
    "1050": "hipped",
    "1060": "mansard",
    "1070": "pyramidal",
    "1080": "pyramidal",
    "1090": "pyramidal",
    "1100": "sawtooth",
    "1110": "barrel",
    "2100": "shed",
    "3100": "gabled",
    "3200": "hipped",
    "3300": "hipped",
    "3400": "mansard",
    "3500": "pyramidal",
}
"""Codes of SIG3D (and of the German cadastre, from 2000 on) with the roof's name."""
_LEAST_EXTENT = 2.0
"""Least extent of a city model's buildings, metres; less are degrees."""


def read_place(path: Path) -> Place:
    """Reads a place by its file's ending: OpenStreetMap, CityGML or CityJSON.

    City models have no streets that plots could lie along; what needs some stays unknown.

    Raises:
        EnvgenError: The file cannot be read, or holds no building.
    """
    name = path.name.lower()
    if name.endswith(_OSM):
        return read_osm_place(path)
    suffix = content_suffix(path)
    if suffix not in (*_CITYJSON, *_CITYGML):
        known = ", ".join((*_OSM, *_CITYGML, *_CITYJSON))
        raise EnvgenError(f"{path}: no place is read of such a file; known endings: {known}")
    city = read_cityjson(path) if suffix in _CITYJSON else read_city(path)
    return _place(city, path)


def _place(city: City, path: Path) -> Place:
    buildings = [thing for thing in city.of_kind("Building") if not extent_fault(thing)]
    shapes = [footprint_of(building) for building in buildings]
    largest = [max(shapely.get_parts(s), key=shapely.area, default=None) for s in shapes]
    kept = [number for number, shape in enumerate(largest) if shape is not None]
    if not kept:
        raise EnvgenError(f"{path}: holds no building with a footprint")
    footprints = np.array([largest[number] for number in kept], object)
    if np.ptp(shapely.total_bounds(footprints).reshape(2, 2), axis=0).max() < _LEAST_EXTENT:
        raise EnvgenError(
            f"{path}: its buildings cover less than {_LEAST_EXTENT:g} m; transform the file to a "
            "projected reference system in metres"
        )
    left_out = len(city.of_kind("Building")) - len(kept)
    issues = [Issue("place.no_streets", Severity.INFO, path.name, _NO_STREETS, "values stay")]
    if left_out:
        text = f"{left_out} buildings have no usable geometry"
        issues.append(Issue("place.building", Severity.WARNING, path.name, text, "left out"))
    return Place(
        path.name,
        _houses(footprints, [buildings[number] for number in kept]),
        Streets(*(np.empty(0, kind) for kind in (object, float, bool, float, float))),
        np.empty((0, 2)),
        np.empty((0, 2)),
        np.empty(0, object),
        np.empty(0, np.str_),
        city.crs,
        (*city.issues, *issues),
    )


_NO_STREETS = "a city model tells nothing about setbacks, plots and what stands along streets"


def _houses(footprints: np.ndarray, buildings: Sequence[CityObject]) -> Houses:
    words = np.full(len(buildings), "", np.str_)
    functions = [str(building.attributes.get("function", "")) for building in buildings]
    return Houses(
        footprints,
        np.array([_height(building) for building in buildings]),
        np.array([_number(building, "storeysAboveGround") for building in buildings]),
        words,
        np.array([_landuse(function) for function in functions], np.str_),
        np.array([_roof(building) for building in buildings], np.str_),
        words,
        words,
    )


def _height(building: CityObject) -> float:
    """Height of the geometry of a building with its parts, metres; NaN without."""
    points = [
        polygons.points[:, 2]
        for part in building.walk()
        for polygons in (*(s.polygons for s in part.surfaces), *part.geometry.values())
        if len(polygons.points)
    ]
    height = float(np.ptp(np.concatenate(points))) if points else 0.0
    return height if height > 0.0 else _number(building, "height")


def _number(building: CityObject, name: str) -> float:
    try:
        value = float(str(building.attributes.get(name, "nan")))
    except ValueError:
        return float("nan")
    return value if 0.0 < value < float("inf") else float("nan")


def _roof(building: CityObject) -> str:
    codes = (str(part.attributes.get("roofType", "")) for part in building.walk())
    return next((_ROOFS[code] for code in codes if code in _ROOFS), "")


def _landuse(function: str) -> str:
    """Area type by SIG3D's code of a function or the German cadastre's (31001_...)."""
    code = function.split(";", maxsplit=1)[0].removeprefix("31001_")
    if code in ("1000", "1010", "1020", "1022", "1024"):
        return "residential"
    return "industrial" if code[:2] in ("13", "21", "24") else ""
