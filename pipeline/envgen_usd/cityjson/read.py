"""Reads a city from CityJSON 1.0, 1.1 and 2.0."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from envgen_usd.cityjson.geometry_read import GeometryReader, Json, Shapes, scalars
from envgen_usd.cityjson.types import OBJECT_KINDS
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.collections import join
from envgen_usd.models.city import CONSTRUCTIONS, City, CityObject, Placement

_OWN = frozenset({"relations", "spaces", "citygml_class", "template", "template_size"})
# What indexing and calling bring about where a file is not built as the specification says.
_MISFITS = (AttributeError, IndexError, KeyError, RecursionError, TypeError, ValueError)
_TEMPLATES = {"SolitaryVegetationObject": "tree"}


def read_cityjson(path: Path) -> City:
    """Reads a CityJSON file, also one that another program wrote.

    Args:
        path: The file.

    Raises:
        EnvgenError: The file is missing, is no JSON, or is no CityJSON of a known version.
    """
    try:
        file = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise EnvgenError(f"{path}: is no JSON: {error}") from error
    if not isinstance(file, dict) or file.get("type") != "CityJSON":
        raise EnvgenError(f"{path}: is no CityJSON: its type is not CityJSON")
    if str(file.get("version")) not in ("1.0", "1.1", "2.0"):
        raise EnvgenError(f"{path}: CityJSON {file.get('version')}: known are 1.0, 1.1 and 2.0")
    try:
        return _city(file)
    except _MISFITS as error:
        raise EnvgenError(f"{path}: does not follow CityJSON: {error!r}") from error


def _city(file: Json) -> City:
    translate = file.get("transform", {}).get("translate", [0, 0, 0])
    x, y, z = (float(round(value, 3)) for value in translate)
    geometry = GeometryReader(file, np.array([x, y, z]))
    items: Json = file["CityObjects"]
    tops = [name for name, item in items.items() if not item.get("parents")]
    return City(
        objects=tuple(_object(name, items, geometry) for name in tops),
        crs=_crs(file.get("metadata", {}).get("referenceSystem", "")),
        offset=(x, y, z),
    )


def _crs(name: str) -> str:
    found = re.search(r"EPSG(?:/[^/]*/|:[^:]*:)(\d+)$", name)
    return f"EPSG:{found[1]}" if found else name


def _object(name: str, items: Json, geometry: GeometryReader) -> CityObject:
    item = items[name]
    attributes: Json = item.get("attributes", {})
    kind = OBJECT_KINDS.get(item["type"], "GenericOccupiedSpace")
    # Our own placements have the name of their template; no construction's has.
    shaped = kind in CONSTRUCTIONS and "template" not in attributes
    shapes = geometry.read(item.get("geometry", []), name, shaped=shaped)
    own = _part(name, attributes.get("citygml_class", kind), attributes, shapes.pop(""))
    spaces = tuple(_space(space, shapes) for space in attributes.get("spaces", []))
    children = (_object(child, items, geometry) for child in item.get("children", []))
    if kind == "TINRelief" and own.geometry:
        own = replace(own, geometry={"tin": join(list(own.geometry.values()))})
    return replace(own, children=(*spaces, *children))


def _space(space: Json, shapes: dict[str, Shapes]) -> CityObject:
    """A part of a road, which is no city object of its own in the file."""
    attributes = space.get("attributes", {})
    part = _part(space["id"], space["kind"], attributes, shapes.get(space["id"], Shapes()))
    return replace(part, children=tuple(_space(s, shapes) for s in space.get("spaces", [])))


def _part(name: str, kind: str, attributes: Json, shapes: Shapes) -> CityObject:
    return CityObject(
        id=name,
        kind=kind,
        attributes=scalars({key: value for key, value in attributes.items() if key not in _OWN}),
        surfaces=tuple(shapes.surfaces),
        solid_lod=shapes.solid_lod,
        geometry=shapes.geometry,
        curves=shapes.curves,
        placement=_named(shapes.placement, kind, attributes),
        relations={role: tuple(ids) for role, ids in attributes.get("relations", {}).items()},
    )


def _named(placement: Placement | None, kind: str, attributes: Json) -> Placement | None:
    """A placement with the template and the size that the attributes name."""
    if placement is None:
        return None
    size = np.array(attributes.get("template_size", placement.size), dtype=np.float64)
    template = attributes.get("template", _TEMPLATES.get(kind, ""))
    return replace(placement, size=size, template=template)
