"""Writes a city as CityJSON 2.0."""

import json
import os
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
from pyproj.exceptions import CRSError

from envgen_usd.chunks import GRID
from envgen_usd.cityjson.geometry_write import GeometryWriter, Json, attributes_json
from envgen_usd.cityjson.types import (
    OBJECT_KINDS,
    OBJECT_TYPES,
    SURFACE_TYPES,
    TRANSPORT_PARTS,
    may_hold,
)
from envgen_usd.models.city import City, CityObject, ThematicSurface


def write_cityjson(city: City, path: Path) -> None:
    """Writes a city as CityJSON 2.0; the file appears only when it is complete.

    Coordinates are integers in multiples of `chunks.GRID` in the road frame; the file's transform
    leads to those of `City.crs`. Sections and traffic spaces, which CityJSON does not have, are
    attributes of their road (``spaces``), and their surfaces and centre lines name them
    (``space``). What CityJSON cannot hold is left out: solids of traffic spaces, lines at
    buildings, a CRS that no registry knows.

    Args:
        city: Points on `chunks.GRID`; others are rounded to it.
        path: File to write.
    """
    text = json.dumps(cityjson(city), separators=(",", ":"), allow_nan=False)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def cityjson(city: City) -> Json:
    """Returns a city as the object that a CityJSON file holds; see `write_cityjson`."""
    geometry = GeometryWriter()
    objects: Json = {}
    for feature in _tops(city.objects):
        _add(feature, "", geometry, objects)
    made: Json = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [GRID] * 3, "translate": [float(v) for v in city.offset]},
        "metadata": _metadata(city, geometry),
        "CityObjects": objects,
        "vertices": [list(place) for place in geometry.vertices],
    }
    if geometry.materials:
        made["appearance"] = {"materials": [{"name": name} for name in geometry.materials]}
    if geometry.templates:
        made["geometry-templates"] = geometry.templates_json()
    return made


def _tops(features: tuple[CityObject, ...]) -> Iterator[CityObject]:
    for feature in features:
        if feature.kind == "ReliefFeature":
            yield from _tops(feature.children)
        else:
            yield feature


def _metadata(city: City, geometry: GeometryWriter) -> Json:
    made: Json = {}
    if geometry.vertices:
        places = np.array(list(geometry.vertices)) * GRID + city.offset
        extent = np.concatenate([places.min(axis=0), places.max(axis=0)])
        made["geographicalExtent"] = np.round(extent, 3).tolist()
    try:
        code = pyproj.CRS.from_user_input(city.crs).to_epsg() if city.crs else None
    except CRSError:
        code = None
    if code:
        made["referenceSystem"] = f"https://www.opengis.net/def/crs/EPSG/0/{code}"
    return made


def _type(kind: str) -> str:
    return OBJECT_TYPES.get(kind, "Road" if kind in TRANSPORT_PARTS else "GenericCityObject")


def _add(feature: CityObject, parent: str, geometry: GeometryWriter, objects: Json) -> None:
    """Adds a feature, and what below it is a city object of its own."""
    kind = _type(feature.kind)
    made: Json = {"type": kind}
    objects[feature.id] = made
    attributes = _attributes(feature)
    if OBJECT_KINDS[kind] != feature.kind:
        attributes["citygml_class"] = feature.kind
    own = [child for child in feature.children if child.kind in OBJECT_TYPES]
    folded = [child for child in feature.children if child.kind not in OBJECT_TYPES]
    if folded:
        attributes["spaces"] = [_space(child) for child in folded]
    if attributes:
        made["attributes"] = attributes
    shapes = list(_geometry(feature, kind, "", geometry))
    for child in folded:
        shapes += _geometry_below(child, kind, geometry)
    if shapes:
        made["geometry"] = shapes
    if parent:
        made["parents"] = [parent]
    if own:
        made["children"] = [child.id for child in own]
    for child in own:
        _add(child, feature.id, geometry, objects)


def _attributes(feature: CityObject) -> dict[str, Any]:
    made = attributes_json(feature.attributes)
    if feature.relations:
        made["relations"] = {role: list(ids) for role, ids in feature.relations.items()}
    if feature.placement is not None:
        made["template"] = feature.placement.template
        made["template_size"] = feature.placement.size.tolist()
    return made


def _space(feature: CityObject) -> Json:
    """A part of a road that is no city object of its own."""
    made: Json = {"id": feature.id, "kind": feature.kind}
    if attributes := _attributes(feature):
        made["attributes"] = attributes
    if feature.children:
        made["spaces"] = [_space(child) for child in feature.children]
    return made


def _geometry_below(feature: CityObject, kind: str, geometry: GeometryWriter) -> Iterator[Json]:
    for part in feature.walk():
        yield from _geometry(part, kind, part.id, geometry)


def _geometry(
    feature: CityObject, kind: str, space: str, geometry: GeometryWriter
) -> Iterator[Json]:
    """Geometry of a feature for a city object of a type; a space is named in its semantics."""
    levels: dict[int, list[tuple[ThematicSurface, str]]] = defaultdict(list)
    for surface in feature.surfaces:
        if surface.kind in SURFACE_TYPES:
            levels[surface.lod].append((surface, space))
    for lod, surfaces in levels.items():
        closed = lod == feature.solid_lod and may_hold(kind, "Solid")
        shape = "Solid" if closed else _surface_type(kind)
        yield geometry.thematic(shape, lod, surfaces)
    for name, polygons in feature.geometry.items():
        shape = "Solid" if name.endswith("Solid") else _surface_type(kind)
        if may_hold(kind, shape) and not space:
            yield geometry.plain(shape, _lod(name), polygons)
    for name, curves in feature.curves.items():
        if may_hold(kind, "MultiLineString") and name.endswith("MultiCurve"):
            yield geometry.lines(_lod(name), curves, _line_semantics(feature, space))
    if feature.placement is not None and may_hold(kind, "GeometryInstance"):
        yield geometry.instance(feature.placement)


def _surface_type(kind: str) -> str:
    return "CompositeSurface" if kind == "TINRelief" else "MultiSurface"


def _lod(name: str) -> int:
    return int(name[3]) if name.startswith("lod") else 1


def _line_semantics(feature: CityObject, space: str) -> Json | None:
    if not space:
        return None
    auxiliary = feature.kind == "AuxiliaryTrafficSpace"
    return {"type": "AuxiliaryTrafficArea" if auxiliary else "TrafficArea", "space": space}
