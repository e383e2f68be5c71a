"""Dangling references between features."""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from lxml import etree

from envgen_usd.citygml.xml_stream import stream_elements
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.xml_events import local_name, namespace_of

_HREF = "{http://www.w3.org/1999/xlink}href"
_IDS = ("{http://www.opengis.net/gml/3.2}id", "{http://www.opengis.net/gml}id")
_KEPT_FILES = 64


def reference_issues(path: Path) -> tuple[Issue, ...]:
    """Returns references to features that do not exist, in this file or in another file.

    The issue kind is ``gml.reference``. References between geometries, which `geometry_issues`
    follows, and web addresses are skipped.

    Args:
        path: CityGML of any version.

    Raises:
        EnvgenError: The file cannot be read or is not XML.
    """
    issues = []
    for target, where, line in _references(path):
        file, _, name = target.partition("#")
        other = path.parent / file if file else path
        if not _holds(other, name):
            message = f"no feature in {other.name if file else 'the file'} has the id '{name}'"
            issues.append(Issue("gml.reference", Severity.ERROR, where, message, line=line))
    return tuple(issues)


def _references(path: Path) -> Iterator[tuple[str, str, int]]:
    """Target, referring feature's id, and line of each reference."""
    for element in _elements(path):
        target = element.get(_HREF, "")
        if "#" in target and "://" not in target and not _is_geometry(element):
            line = element.sourceline
            yield target, _owner(element), line if isinstance(line, int) else 0


def _is_geometry(element: etree._Element) -> bool:
    inside = namespace_of(element)
    return "/gml" in inside or local_name(element).startswith(("lod", "relative"))


def _owner(element: etree._Element) -> str:
    """Id of the nearest feature around an element."""
    around = (_id(ancestor) for ancestor in element.iterancestors())
    return next((name for name in around if name), "")


def _id(element: etree._Element) -> str:
    return next((found for found in map(element.get, _IDS) if found), "")


def _holds(path: Path, name: str) -> bool:
    try:
        return name in _ids(path, path.stat().st_mtime_ns)
    except (EnvgenError, OSError):
        return False


@lru_cache(maxsize=_KEPT_FILES)
def _ids(path: Path, _changed: int) -> frozenset[str]:
    """Ids in a file; the modification time is part of the cache key."""
    return frozenset(filter(None, map(_id, _elements(path))))


def _elements(path: Path) -> Iterator[etree._Element]:
    """Yields all elements at their start; memory does not grow with the file."""
    for event, element in stream_elements(path, events=("start", "end")):
        if event == "start":
            yield element
        elif local_name(element).endswith("ember"):
            element.clear()
