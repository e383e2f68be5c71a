"""Writes a city as CityJSON 2.0."""

import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
from pyproj.exceptions import CRSError

from envgen_usd.chunks import GRID
from envgen_usd.cityjson.cityjson_geometry_write import GeometryWriter, Json
from envgen_usd.cityjson.cityjson_types import (
    OBJECT_KINDS,
    OBJECT_TYPES,
    TRANSPORT_PARTS,
    may_hold,
)
from envgen_usd.cityjson.json_attributes import attributes_json
from envgen_usd.geometry.polygon_keys import PolygonKey, polygon_keys
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons, Solids
from envgen_usd.whole_files import write_whole


def write_cityjson(city: City, path: Path) -> None:
    """Writes a city as CityJSON 2.0; the file is written whole or not at all.

    Coordinates are integers in multiples of `chunks.GRID` in the road frame; the file's transform
    leads to `City.crs`. CityJSON lacks sections and traffic spaces: they become the attribute
    ``spaces`` of their road. Their surfaces and centre lines name them (``space``). Solids of
    traffic spaces, lines of buildings and unregistered CRSs are left out.

    Args:
        city: Points on `chunks.GRID`; other points are rounded to it.
        path: File to write.

    Raises:
        EnvgenError: The file cannot be written.
    """
    text = json.dumps(cityjson(city), separators=(",", ":"), allow_nan=False)
    write_whole(path, text)


def cityjson(city: City) -> Json:
    """Returns a city as a CityJSON object; see `write_cityjson`."""
    geometry = GeometryWriter()
    objects: Json = {}
    for feature in _tops(city.objects):
        _add(feature, "", geometry, objects)
    file: Json = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [GRID] * 3, "translate": [float(v) for v in city.offset]},
        "metadata": _metadata(city, geometry),
        "CityObjects": objects,
        "vertices": [list(place) for place in geometry.vertices],
    }
    if geometry.materials:
        file["appearance"] = {"materials": [{"name": name} for name in geometry.materials]}
    if geometry.templates:
        file["geometry-templates"] = geometry.templates_json()
    return file


def _tops(features: tuple[CityObject, ...]) -> Iterator[CityObject]:
    for feature in features:
        if feature.kind == "ReliefFeature":
            yield from _tops(feature.children)
        else:
            yield feature


def _metadata(city: City, geometry: GeometryWriter) -> Json:
    metadata: Json = {}
    if geometry.vertices:
        places = np.array(list(geometry.vertices)) * GRID + city.offset
        extent = np.concatenate([places.min(axis=0), places.max(axis=0)])
        metadata["geographicalExtent"] = np.round(extent, 3).tolist()
    try:
        code = pyproj.CRS.from_user_input(city.crs).to_epsg() if city.crs else None
    except CRSError:
        code = None
    if code:
        metadata["referenceSystem"] = f"https://www.opengis.net/def/crs/EPSG/0/{code}"
    return metadata


def _type(kind: str) -> str:
    return OBJECT_TYPES.get(kind, "Road" if kind in TRANSPORT_PARTS else "GenericCityObject")


def _add(feature: CityObject, parent: str, geometry: GeometryWriter, objects: Json) -> None:
    """Adds a feature, and its parts that are city objects."""
    kind = _type(feature.kind)
    city_object: Json = {"type": kind}
    objects[feature.id] = city_object
    attributes = _attributes(feature)
    if OBJECT_KINDS[kind] != feature.kind:
        attributes["citygml_class"] = feature.kind
    children = [child for child in feature.children if child.kind in OBJECT_TYPES]
    folded = [child for child in feature.children if child.kind not in OBJECT_TYPES]
    if folded:
        attributes["spaces"] = [_space(child) for child in folded]
    if attributes:
        city_object["attributes"] = attributes
    shapes = list(_geometry(feature, kind, "", geometry))
    for child in folded:
        shapes += _geometry_below(child, kind, geometry)
    if shapes:
        city_object["geometry"] = shapes
    if parent:
        city_object["parents"] = [parent]
    if children:
        city_object["children"] = [child.id for child in children]
    for child in children:
        _add(child, feature.id, geometry, objects)


def _attributes(feature: CityObject) -> dict[str, Any]:
    attributes = attributes_json(feature.attributes)
    if feature.relations:
        attributes["relations"] = {role: list(ids) for role, ids in feature.relations.items()}
    if feature.placement is not None:
        attributes["template"] = feature.placement.template
        attributes["template_size"] = feature.placement.size.tolist()
    return attributes


def _space(feature: CityObject) -> Json:
    """A part of a road that is not a city object."""
    space: Json = {"id": feature.id, "kind": feature.kind}
    if attributes := _attributes(feature):
        space["attributes"] = attributes
    if feature.children:
        space["spaces"] = [_space(child) for child in feature.children]
    return space


def _geometry_below(feature: CityObject, kind: str, geometry: GeometryWriter) -> Iterator[Json]:
    for part in feature.walk():
        yield from _geometry(part, kind, part.id, geometry)


def _geometry(
    feature: CityObject, kind: str, space: str, geometry: GeometryWriter
) -> Iterator[Json]:
    """Geometry of a feature for a city object type; its semantics name a space."""
    levels: dict[int, list[tuple[ThematicSurface, str]]] = defaultdict(list)
    for surface in feature.surfaces:
        levels[surface.lod].append((surface, space))
    for name, polygons in feature.geometry.items():
        solids = _solid_type(kind, polygons) if name.endswith("Solid") else ""
        if solids and not space:
            lod = _lod(name)
            known = set(polygon_keys(polygons))
            bounds = [each for each in levels[lod] if _is_among(each[0], known)]
            levels[lod] = [each for each in levels[lod] if each not in bounds]
            yield geometry.solids(solids, lod, polygons, bounds)
        elif not name.endswith("Solid") and not space:
            shape = _surface_type(kind)
            if may_hold(kind, shape):
                yield geometry.plain(shape, _lod(name), polygons)
    for lod, surfaces in levels.items():
        closed = lod == feature.solid_lod and may_hold(kind, "Solid")
        if surfaces:
            shape = "Solid" if closed else _surface_type(kind)
            yield geometry.thematic(shape, lod, surfaces)
    for name, curves in feature.curves.items():
        if may_hold(kind, "MultiLineString") and name.endswith("MultiCurve"):
            yield geometry.lines(_lod(name), curves, _line_semantics(feature, space))
    if feature.placement is not None and may_hold(kind, "GeometryInstance"):
        yield geometry.instance(feature.placement)


def _solid_type(kind: str, polygons: Polygons) -> str:
    """Geometry type of solids that a city object type may have; empty if there is none."""
    several = isinstance(polygons, Solids) and int(polygons.solid.max()) > 0
    wanted = ["CompositeSolid", "MultiSolid"] if several else ["Solid"]
    if isinstance(polygons, Solids) and not polygons.composite:
        wanted.reverse()
    return next((shape for shape in wanted if may_hold(kind, shape)), "")


def _is_among(surface: ThematicSurface, known: set[PolygonKey]) -> bool:
    """True for a surface whose polygons, and those of its openings, are all among others."""
    return set(polygon_keys(surface.polygons)) <= known and all(
        _is_among(opening, known) for opening in surface.openings
    )


def _surface_type(kind: str) -> str:
    return "CompositeSurface" if kind == "TINRelief" else "MultiSurface"


def _lod(name: str) -> int:
    return int(name[3]) if name.startswith("lod") else 1


def _line_semantics(feature: CityObject, space: str) -> Json | None:
    if not space:
        return None
    auxiliary = feature.kind == "AuxiliaryTrafficSpace"
    return {"type": "AuxiliaryTrafficArea" if auxiliary else "TrafficArea", "space": space}
