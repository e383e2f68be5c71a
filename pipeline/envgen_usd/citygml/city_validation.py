"""Validates CityGML files against the schema, and their geometry against ISO 19107."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import Any, cast

from lxml import etree

from envgen_usd.citygml.foreign_city import find_frame, shared_geometry
from envgen_usd.citygml.raw_bodies import BodyReader
from envgen_usd.citygml.xml_stream import MEMBERS, stream_members
from envgen_usd.citygml.xsd_files import load_schema
from envgen_usd.compressed_files import open_content
from envgen_usd.errors import EnvgenError, Issue, Severity, one_line
from envgen_usd.geometry.city_frame import Frame
from envgen_usd.geometry.iso19107.fault_report import body_issues
from envgen_usd.xml_events import local_name, namespace_of, refuse_entities, safe_parser

_BATCH = 20_000
_MOST_SCHEMA_ISSUES = 1000


def schema_issues(path: Path, folder: Path | None = None) -> tuple[Issue, ...]:
    """Returns violations of the schema of the file's CityGML version.

    Args:
        path: CityGML 1.0, 2.0 or 3.0.
        folder: Folder of the CityGML schemas; `None` means that they are downloaded once and kept.

    Raises:
        EnvgenError: The file is missing or is not CityGML, or there are no schemas.
    """
    tree = _parse(path)
    namespace = namespace_of(tree.getroot())
    if local_name(tree.getroot()) != "CityModel" or "/citygml/" not in namespace:
        raise EnvgenError(f"{path}: not CityGML: its root element is not CityModel")
    schema = load_schema(namespace.rpartition("/")[2], folder)
    schema.validate(tree)
    entries = cast("Iterable[Any]", schema.error_log)
    return tuple(
        Issue("xsd", Severity.ERROR, entry.path or path.name, entry.message, line=entry.line)
        for entry in islice(entries, _MOST_SCHEMA_ISSUES)
    )


def _parse(path: Path) -> etree._ElementTree:
    try:
        with open_content(path) as file:
            tree = etree.parse(file, safe_parser())
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror or error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{path}: is not well-formed XML: {one_line(error)}") from error
    refuse_entities(tree, path)
    return tree


def geometry_issues(path: Path) -> tuple[Issue, ...]:
    """Returns the faults of the polygons and solids of a file.

    Geographic coordinates are projected; coordinates of an unknown CRS count as metres.

    Args:
        path: CityGML 1.0, 2.0 or 3.0.

    Raises:
        EnvgenError: The file is missing or is not CityGML.
    """
    frame = find_frame(path)
    issues = _geometry_issues(path, frame, {})
    if any(issue.kind == "gml.reference" for issue in issues):
        # Few files share geometry between features; collecting it takes a second pass.
        issues = _geometry_issues(path, frame, shared_geometry(path))
    return tuple(issues)


def _geometry_issues(path: Path, frame: Frame, shared: Mapping[str, etree._Element]) -> list[Issue]:
    issues: list[Issue] = []
    reader = BodyReader()
    members = (m for m in stream_members(path) if local_name(m) in MEMBERS)
    for feature in chain.from_iterable(members):
        reader.add(feature, shared)
        if len(reader.placed.polygons) >= _BATCH:
            issues += _faults(reader, frame)
            reader = BodyReader()
    return issues + _faults(reader, frame)


def _faults(reader: BodyReader, frame: Frame) -> list[Issue]:
    """Issues of the collected bodies; templates are in metres."""
    bodies = reader.placed.bodies()
    points = frame.place(bodies.polygons.points)
    bodies = replace(bodies, polygons=replace(bodies.polygons, points=points))
    templates = body_issues(reader.templates, reader.templates.bodies())
    return body_issues(reader.placed, bodies) + templates
