"""The XML schemas of CityGML: from a folder, or fetched once from the standard's address."""

import os
import posixpath
import urllib.error
import urllib.request
from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import urlsplit

from lxml import etree

from envgen_usd.errors import EnvgenError

_PLACE = "schemas.opengis.net/citygml"
_NAMESPACE = "http://www.opengis.net/citygml"
_XS = "{http://www.w3.org/2001/XMLSchema}"
_TIMEOUT = 30.0
_CORE = {"1.0": "cityGMLBase.xsd", "2.0": "cityGMLBase.xsd", "3.0": "core.xsd"}
_SHARED = {
    "appearance": "appearance.xsd",
    "building": "building.xsd",
    "cityfurniture": "cityFurniture.xsd",
    "cityobjectgroup": "cityObjectGroup.xsd",
    "generics": "generics.xsd",
    "landuse": "landUse.xsd",
    "relief": "relief.xsd",
    "transportation": "transportation.xsd",
    "vegetation": "vegetation.xsd",
    "waterbody": "waterBody.xsd",
}
_SINCE_2 = {"bridge": "bridge.xsd", "tunnel": "tunnel.xsd"}
_SINCE_3 = {
    "construction": "construction.xsd",
    "dynamizer": "dynamizer.xsd",
    "pointcloud": "pointCloud.xsd",
    "versioning": "versioning.xsd",
}
_MODULES = {
    "1.0": _SHARED,
    "2.0": {**_SHARED, **_SINCE_2},
    "3.0": {**_SHARED, **_SINCE_2, **_SINCE_3},
}


def fetch(address: str) -> bytes:
    """Returns what lies at an address of the web.

    Raises:
        EnvgenError: Nothing can be had from there.
    """
    request = urllib.request.Request(address, headers={"User-Agent": "envgen-usd"})
    try:
        with urllib.request.urlopen(request, timeout=_TIMEOUT) as answer:
            body: bytes = answer.read()
    except (urllib.error.URLError, OSError) as error:
        raise EnvgenError(
            f"{address}: the schema cannot be fetched ({error}); give --schemas FOLDER with the"
            " schemas of CityGML, or --no-schema to check geometry and references only"
        ) from error
    return body


def cache_folder() -> Path:
    """Folder in which fetched schemas are kept."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "envgen-usd" / "schemas"


def load_schema(
    version: str, folder: Path | None = None, fetched_by: Callable[[str], bytes] = fetch
) -> etree.XMLSchema:
    """Returns the schema of all modules of CityGML.

    Args:
        version: ``1.0``, ``2.0`` or ``3.0``.
        folder: Holds the schemas, in whatever subfolders; none: they are fetched from the
            standard's address when they are used for the first time, and kept in `cache_folder`.
        fetched_by: Returns the content of an address.

    Raises:
        EnvgenError: There is no such version, or its schemas are not to be had.
    """
    if version not in _MODULES:
        raise EnvgenError(f"CityGML {version or '(no version)'}: known are 1.0, 2.0 and 3.0")
    if folder is None:
        root = cache_folder()
        places = _places(version)
        _mirror(places.values(), root, fetched_by)
        files = {namespace: root / place for namespace, place in places.items()}
    else:
        root, files = folder, _find(version, folder)
    return _compile(files, root)


def _places(version: str) -> dict[str, str]:
    """Host and path of each module's schema by its namespace."""
    modules = {
        f"{_NAMESPACE}/{module}/{version}": f"{_PLACE}/{module}/{version}/{file}"
        for module, file in _MODULES[version].items()
    }
    return {f"{_NAMESPACE}/{version}": f"{_PLACE}/{version}/{_CORE[version]}", **modules}


def _mirror(places: Iterable[str], root: Path, fetched_by: Callable[[str], bytes]) -> None:
    """Copies schemas, and those that they import or include, to their places below a folder."""
    waiting, known = list(places), set(places)
    while waiting:
        place = waiting.pop()
        file = root / place
        if not file.exists():
            _keep(fetched_by(f"https://{place}"), place, file)
        found = {
            _target(place, link.get("schemaLocation", "")) for link in _links(etree.parse(file))
        }
        waiting += sorted(found - known)
        known |= found


def _links(tree: etree._ElementTree) -> list[etree._Element]:
    """Elements that name other schemas."""
    elements = tree.iter(f"{_XS}import", f"{_XS}include")
    return [element for element in elements if element.get("schemaLocation")]


def _target(place: str, name: str) -> str:
    """Place of a schema that the one at a place names."""
    if "://" in name:
        parts = urlsplit(name)
        return f"{parts.netloc}{parts.path}"
    return posixpath.normpath(posixpath.join(posixpath.dirname(place), name))


def _keep(body: bytes, place: str, file: Path) -> None:
    """Keeps a schema; it then names others by relative paths, so that no network is asked."""
    try:
        tree = etree.ElementTree(etree.fromstring(body))
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"https://{place}: what is there is no schema: {error}") from error
    for link in _links(tree):
        target = _target(place, link.get("schemaLocation", ""))
        link.set("schemaLocation", posixpath.relpath(target, posixpath.dirname(place)))
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f".{file.name}.{os.getpid()}")
    part.write_bytes(etree.tostring(tree))
    part.replace(file)


def _find(version: str, folder: Path) -> dict[str, Path]:
    """File of each module's schema by its namespace, wherever it lies in the folder."""
    found = {}
    for namespace, place in _places(version).items():
        mark = f'targetNamespace="{namespace}"'
        files = sorted(folder.rglob(place.rpartition("/")[2]))
        matching = [file for file in files if mark in file.read_text("utf-8", errors="replace")]
        if not matching:
            raise EnvgenError(f"{folder}: holds no schema of {namespace}")
        found[namespace] = matching[0]
    return found


def _compile(files: dict[str, Path], root: Path) -> etree.XMLSchema:
    imports = "".join(
        f'<xs:import namespace="{namespace}" schemaLocation="{file.resolve().as_uri()}"/>'
        for namespace, file in files.items()
    )
    text = (
        '<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="urn:envgen-usd">'
        f"{imports}</xs:schema>"
    )
    try:
        return etree.XMLSchema(etree.fromstring(text, etree.XMLParser(no_network=True)))
    except etree.XMLSchemaParseError as error:
        raise EnvgenError(f"{root}: the schemas cannot be used: {error}") from error
