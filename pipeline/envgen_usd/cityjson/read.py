"""Reads a city from CityJSON 1.0, 1.1 and 2.0, and from CityJSONSeq."""

import json
import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from envgen_usd.cityjson.cityjson_geometry_read import (
    GeometryReader,
    Json,
    Shapes,
    vertices_of,
)
from envgen_usd.cityjson.cityjson_types import OBJECT_KINDS
from envgen_usd.cityjson.json_attributes import read_attributes
from envgen_usd.compressed_files import LARGEST_WHOLE, content_suffix, read_content
from envgen_usd.errors import EnvgenError, Issue, Severity, one_line
from envgen_usd.geometry.city_frame import Frame, frame_of, is_in_metres
from envgen_usd.geometry.flat_arrays import join
from envgen_usd.models.city_model import CONSTRUCTIONS, City, CityObject, Placement

_OWN = frozenset({"relations", "spaces", "citygml_class", "template", "template_size"})
MISFITS = (
    AttributeError,
    IndexError,
    KeyError,
    OverflowError,
    RecursionError,
    TypeError,
    ValueError,
)
"""Errors that indexing and calling raise on files that violate the specification."""
_TEMPLATES = {"SolitaryVegetationObject": "tree"}


def read_cityjson(path: Path) -> City:
    """Reads a CityJSON file, including files of other programs.

    Coordinates are in metres: degrees, feet and geocentric ones are projected to UTM, easting
    first. Objects that violate the specification are left out with an issue. In a CityJSONSeq file
    (.jsonl) the first line is a CityJSON object. Each further line is a feature with separate
    vertices.

    Args:
        path: The file, plain or packed.

    Raises:
        EnvgenError: The file is missing, is not JSON, is not CityJSON of a known version, or has no
            readable object.
    """
    return city_of(path, *load_cityjson(path))


def load_cityjson(path: Path) -> tuple[Json, list[Json]]:
    """Returns the CityJSON object of a file, and the features of a sequence.

    Raises:
        EnvgenError: The file is missing, is not JSON, or is not CityJSON of a known version.
    """
    try:
        text = read_content(path, LARGEST_WHOLE).decode("utf-8")
        lines = text.splitlines() if content_suffix(path) == ".jsonl" else [text]
        file, *features = [json.loads(line) for line in lines if line.strip()] or [None]
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise EnvgenError(f"{path}: not JSON: {one_line(error)}") from error
    if not isinstance(file, dict) or file.get("type") != "CityJSON":
        raise EnvgenError(f"{path}: not CityJSON: its type is not CityJSON")
    if str(file.get("version")) not in ("1.0", "1.1", "2.0"):
        raise EnvgenError(
            f"{path}: CityJSON {file.get('version')} is not supported; known: 1.0, 1.1 and 2.0"
        )
    return file, features


def city_of(path: Path, file: Json, features: Sequence[Json]) -> City:
    """Returns the city of a loaded file.

    Raises:
        EnvgenError: The file has no readable object.
    """
    try:
        return _city(file, features)
    except MISFITS as error:
        raise EnvgenError(f"{path}: does not follow CityJSON: {error!r}") from error


def _city(file: Json, features: Sequence[Json]) -> City:
    """The city of a file, or of the first line and the features of a sequence."""
    crs = _crs(file.get("metadata", {}).get("referenceSystem", ""))
    frame = None if is_in_metres(crs) else _frame(crs, file, features)
    translate = file.get("transform", {}).get("translate", [0, 0, 0])
    offset = np.round(translate if frame is None else frame.offset, 3)
    objects: list[CityObject] = []
    faults: list[tuple[str, Exception]] = []
    coarser: dict[tuple[str, str], list[str]] = defaultdict(list)
    for number, part in enumerate([file, *features]):
        try:
            # A feature shares all members of the first line except objects and vertices.
            whole = {**file, **part} if number else part
            geometry = GeometryReader(whole, offset, frame)
            items: Json = part["CityObjects"]
        except MISFITS as error:
            if not number:
                raise
            faults.append((f"line {number + 1}", error))
            continue
        for name, item in items.items():
            try:
                if not item.get("parents"):
                    objects.append(_object(name, items, geometry))
            except MISFITS as error:
                faults.append((name, error))
        for levels, names in geometry.coarser.items():
            coarser[levels] += names
    if faults and not objects:
        raise faults[0][1]
    x, y, z = offset.tolist()
    return City(
        objects=tuple(objects),
        crs=crs if frame is None else frame.crs,
        offset=(x, y, z),
        issues=(
            *(frame.issues if frame is not None else ()),
            *(_left_out(name, error) for name, error in faults),
            *(_coarser(*levels, names) for levels, names in sorted(coarser.items())),
        ),
    )


def _frame(crs: str, file: Json, features: Sequence[Json]) -> Frame:
    """The frame of coordinates that are not in metres, by the first vertices of the file."""
    parts = (file, *({**file, **feature} for feature in features))
    places = next((found for part in parts if len(found := vertices_of(part))), np.zeros((1, 3)))
    return frame_of(crs, places)


def _left_out(name: str, error: Exception) -> Issue:
    text = f"does not follow CityJSON: {error!r}"
    return Issue("city.feature", Severity.ERROR, name, text, "left out")


def _coarser(level: str, finest: str, names: Sequence[str]) -> Issue:
    text = f"{len(names)} geometries, e.g. of {names[0]}, are also there as LoD {finest}"
    return Issue("city.level", Severity.WARNING, f"LoD {level}", text, f"LoD {finest} taken")


def _crs(name: str) -> str:
    match = re.search(r"EPSG(?:/[^/]*/|:[^:]*:)(\d+)$", name)
    return f"EPSG:{match[1]}" if match else name


def _object(name: str, items: Json, geometry: GeometryReader) -> CityObject:
    item = items[name]
    attributes: Json = item.get("attributes", {})
    kind = OBJECT_KINDS.get(item["type"], "GenericOccupiedSpace")
    # Our placements carry the template's name; those of constructions do not.
    shaped = kind in CONSTRUCTIONS and "template" not in attributes
    shapes = geometry.read(item.get("geometry", []), name, shaped=shaped)
    feature = _part(name, attributes.get("citygml_class", kind), attributes, shapes.pop(""))
    spaces = tuple(_space(space, shapes) for space in attributes.get("spaces", []))
    children = (_object(child, items, geometry) for child in item.get("children", []))
    if kind == "TINRelief" and feature.geometry:
        feature = replace(feature, geometry={"tin": join(list(feature.geometry.values()))})
    return replace(feature, children=(*spaces, *children))


def _space(space: Json, shapes: dict[str, Shapes]) -> CityObject:
    """A part of a road that is not a city object of the file."""
    attributes = space.get("attributes", {})
    part = _part(space["id"], space["kind"], attributes, shapes.get(space["id"], Shapes()))
    return replace(part, children=tuple(_space(s, shapes) for s in space.get("spaces", [])))


def _part(name: str, kind: str, attributes: Json, shapes: Shapes) -> CityObject:
    return CityObject(
        id=name,
        kind=kind,
        attributes=read_attributes(
            {key: value for key, value in attributes.items() if key not in _OWN}
        ),
        surfaces=tuple(shapes.surfaces),
        solid_lod=shapes.solid_lod,
        geometry=shapes.geometry,
        curves=shapes.curves,
        placement=_named(shapes.placement, kind, attributes),
        relations={role: tuple(ids) for role, ids in attributes.get("relations", {}).items()},
    )


def _named(placement: Placement | None, kind: str, attributes: Json) -> Placement | None:
    """A placement with the template and the size of the attributes."""
    if placement is None:
        return None
    size = np.array(attributes.get("template_size", placement.size), dtype=np.float64)
    template = attributes.get("template", _TEMPLATES.get(kind, ""))
    return replace(placement, size=size, template=template)
