"""References between features that lead nowhere."""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from lxml import etree

from envgen_usd.citygml.geometry_read import local_name
from envgen_usd.errors import EnvgenError, Issue, Severity

_HREF = "{http://www.w3.org/1999/xlink}href"
_IDS = ("{http://www.opengis.net/gml/3.2}id", "{http://www.opengis.net/gml}id")
_KEPT_FILES = 64


def reference_issues(path: Path) -> tuple[Issue, ...]:
    """Returns the references to features that are not there, in this file or another beside it.

    Issues are of the kind ``gml.reference``. References of geometry, which `geometry_issues`
    follows, and those to addresses of the web are left out.

    Args:
        path: CityGML of any version.

    Raises:
        EnvgenError: The file cannot be read, or is no XML.
    """
    issues = []
    for target, where, line in _references(path):
        file, _, name = target.partition("#")
        other = path.parent / file if file else path
        if not _holds(other, name):
            message = f"nothing in {other.name if file else 'the file'} has the id '{name}'"
            issues.append(Issue("gml.reference", Severity.ERROR, where, message, line=line))
    return tuple(issues)


def _references(path: Path) -> Iterator[tuple[str, str, int]]:
    """Target, id of the feature that refers to it, and line of each reference."""
    for element in _elements(path):
        target = element.get(_HREF, "")
        if "#" in target and "://" not in target and not _is_geometry(element):
            line = element.sourceline
            yield target, _owner(element), line if isinstance(line, int) else 0


def _is_geometry(element: etree._Element) -> bool:
    inside = etree.QName(element).namespace or ""
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
    """Ids in a file; the time of its last change tells one state of it from another."""
    return frozenset(filter(None, map(_id, _elements(path))))


def _elements(path: Path) -> Iterator[etree._Element]:
    """All elements, each when it begins; memory does not grow with the file."""
    try:
        with path.open("rb") as stream:
            events = etree.iterparse(
                stream,
                events=("start", "end"),
                remove_comments=True,
                remove_pis=True,
                resolve_entities=False,
                no_network=True,
            )
            for event, element in events:
                if event == "start":
                    yield element
                elif local_name(element).endswith("ember"):
                    element.clear()
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror or error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{path}: is not well-formed XML: {error}") from error
