"""Validates CityGML files against the schema, and their geometry against ISO 19107."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from itertools import chain, islice
from pathlib import Path
from typing import Any, cast

import numpy as np
from lxml import etree

from envgen_usd.citygml.city_frame import Frame
from envgen_usd.citygml.foreign_city import find_frame, shared_geometry
from envgen_usd.citygml.gml_geometry_read import local_name
from envgen_usd.citygml.raw_bodies import BodyReader
from envgen_usd.citygml.xml_stream import MEMBERS, stream_members
from envgen_usd.citygml.xsd_files import load_schema
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.flat_arrays import take
from envgen_usd.geometry.iso19107.body_faults import overlaps
from envgen_usd.geometry.iso19107.fault_codes import Fault
from envgen_usd.geometry.iso19107.fault_report import fault_issue, first_issues
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.xml_events import refuse_entities, safe_parser

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
    namespace = str(etree.QName(tree.getroot()).namespace)
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
        tree = etree.parse(path, safe_parser())
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{path}: is not well-formed XML: {error}") from error
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
        if len(reader.polygons) >= _BATCH:
            issues += _faults(reader, frame)
            reader = BodyReader()
    return issues + _faults(reader, frame)


def _faults(reader: BodyReader, frame: Frame) -> list[Issue]:
    """Issues of the collected bodies, a single issue for each object and code."""
    bodies = reader.bodies(frame)
    faults = find_faults(bodies)
    broken = {int(bodies.solid[fault.shell]) for fault in faults if fault.shell >= 0}
    issues = first_issues(_issue(reader, fault) for fault in faults)
    return [*reader.issues, *issues, *_overlaps(reader, bodies, broken)]


def _issue(reader: BodyReader, fault: Fault) -> Issue:
    polygon = reader.polygons[fault.polygon] if fault.polygon >= 0 else None
    if polygon is not None and fault.code < 300:
        return fault_issue(fault.code, polygon.feature, fault.detail, polygon.line)
    name = f", e.g. {polygon.geometry}" if polygon and polygon.geometry else ""
    return reader.shells[fault.shell].fault(fault.code, fault.detail + name)


def _overlaps(reader: BodyReader, bodies: Bodies, broken: set[int]) -> list[Issue]:
    """Fault 601: bodies of a building at the same level of detail that overlap."""
    groups: dict[tuple[str, str], list[int]] = defaultdict(list)
    for solid in np.unique(bodies.solid).tolist():
        if reader.solids[solid][0] and solid not in broken:
            groups[reader.solids[solid]].append(solid)
    several = [group for group in groups.values() if len(group) > 1]
    shells = {n: int(np.searchsorted(bodies.solid, n)) for group in several for n in group}
    order = np.argsort(bodies.shell, kind="stable")
    limits = np.searchsorted(bodies.shell[order], np.arange(len(bodies.solid) + 1))
    solids = {
        n: take(bodies.polygons, order[limits[shell] : limits[shell + 1]])
        for n, shell in shells.items()
    }
    return [
        reader.shells[shells[other]].fault(601, f"{volume:.3f} m³ with another part")
        for _, other, volume in overlaps(solids, several)
    ]
