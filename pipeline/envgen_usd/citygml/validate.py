"""Validates CityGML: against the standard's schema, and its geometry after ISO 19107."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, cast

import numpy as np
from lxml import etree

from envgen_usd.citygml.body_read import BodyReader
from envgen_usd.citygml.crs import Frame
from envgen_usd.citygml.foreign import find_frame, shared_geometry
from envgen_usd.citygml.geometry_read import local_name
from envgen_usd.citygml.references import reference_issues
from envgen_usd.citygml.schemas import load_schema
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.geometry.collections import take
from envgen_usd.geometry.iso19107.bodies import overlaps
from envgen_usd.geometry.iso19107.check import Bodies, find_faults
from envgen_usd.geometry.iso19107.faults import Fault
from envgen_usd.geometry.iso19107.report import fault_issue, one_for_each

_BATCH = 20_000
_MOST_SCHEMA_ISSUES = 1000


def validate_file(path: Path, schema_folder: Path | None = None) -> tuple[Issue, ...]:
    """Returns what is wrong with a CityGML file; nothing where it is valid.

    Issues are of the kinds ``xsd``, ``gml.reference`` (nothing has the id that is referred to) and
    ``iso19107.<code>`` with the codes of val3dity, with one issue for each object and code.

    Args:
        path: CityGML 1.0, 2.0 or 3.0.
        schema_folder: Holds the schemas of CityGML; none: they are fetched once and kept.

    Raises:
        EnvgenError: The file is missing, is no XML or no CityGML, or there are no schemas.
    """
    return (
        *schema_issues(path, schema_folder),
        *geometry_issues(path),
        *reference_issues(path),
    )


def schema_issues(path: Path, folder: Path | None = None) -> tuple[Issue, ...]:
    """Returns where a file does not follow the schema of its version of CityGML.

    Args:
        path: CityGML 1.0, 2.0 or 3.0.
        folder: As for `validate_file`.

    Raises:
        EnvgenError: As for `validate_file`.
    """
    tree = _parse(path)
    namespace = str(etree.QName(tree.getroot()).namespace)
    if local_name(tree.getroot()) != "CityModel" or "/citygml/" not in namespace:
        raise EnvgenError(f"{path}: is no CityGML: its root is not CityModel")
    schema = load_schema(namespace.rpartition("/")[2], folder)
    schema.validate(tree)
    entries = cast("Iterable[Any]", schema.error_log)
    return tuple(
        Issue("xsd", Severity.ERROR, entry.path or path.name, entry.message, line=entry.line)
        for entry in islice(entries, _MOST_SCHEMA_ISSUES)
    )


def _parse(path: Path) -> etree._ElementTree:
    try:
        return etree.parse(path, etree.XMLParser(resolve_entities=False, no_network=True))
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{path}: is not well-formed XML: {error}") from error


def geometry_issues(path: Path) -> tuple[Issue, ...]:
    """Returns what is wrong with the polygons and solids of a file.

    Geographic coordinates are projected; those of an unknown CRS are taken for metres.

    Args:
        path: CityGML 1.0, 2.0 or 3.0.

    Raises:
        EnvgenError: The file is missing, is no XML or no CityGML.
    """
    try:
        frame = find_frame(path)
        issues = _geometry_issues(path, frame, {})
        if any(issue.kind == "gml.reference" for issue in issues):
            # Only few files share geometry between features; looking for it takes a second pass.
            issues = _geometry_issues(path, frame, shared_geometry(path))
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{path}: is not well-formed XML: {error}") from error
    return tuple(issues)


def _geometry_issues(path: Path, frame: Frame, shared: Mapping[str, etree._Element]) -> list[Issue]:
    issues: list[Issue] = []
    reader = BodyReader()
    for feature in _top_level_features(path):
        reader.add(feature, shared)
        if len(reader.polygons) >= _BATCH:
            issues += _faults(reader, frame)
            reader = BodyReader()
    return issues + _faults(reader, frame)


def _top_level_features(path: Path) -> Iterator[etree._Element]:
    members = ("{*}cityObjectMember", "{*}featureMember")
    events = etree.iterparse(
        str(path),
        tag=members,
        resolve_entities=False,
        no_network=True,
        remove_comments=True,
        remove_pis=True,
    )
    for _, member in events:
        parent = member.getparent()
        if parent is not None and local_name(parent) == "CityModel":
            yield from member
            member.clear()
            while member.getprevious() is not None:
                del parent[0]


def _faults(reader: BodyReader, frame: Frame) -> list[Issue]:
    """Issues of what a reader has gathered, one for each object and code."""
    bodies = reader.bodies(frame)
    faults = find_faults(bodies)
    broken = {int(bodies.solid[fault.shell]) for fault in faults if fault.shell >= 0}
    issues = one_for_each(_issue(reader, fault) for fault in faults)
    return [*reader.issues, *issues, *_overlaps(reader, bodies, broken)]


def _issue(reader: BodyReader, fault: Fault) -> Issue:
    polygon = reader.polygons[fault.polygon] if fault.polygon >= 0 else None
    if polygon is not None and fault.code < 300:
        return fault_issue(fault.code, polygon.feature, fault.detail, polygon.line)
    name = f", e.g. {polygon.geometry}" if polygon and polygon.geometry else ""
    return reader.shells[fault.shell].fault(fault.code, fault.detail + name)


def _overlaps(reader: BodyReader, bodies: Bodies, broken: set[int]) -> list[Issue]:
    """Fault 601: bodies of one building, of the same level of detail, that share space."""
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
