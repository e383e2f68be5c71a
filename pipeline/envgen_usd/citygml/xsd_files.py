"""The XML schemas of CityGML, from a folder or downloaded once from the OGC."""

import os
import posixpath
import urllib.error
import urllib.request
from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import urlsplit

from lxml import etree

from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.whole_files import make_folder, write_whole
from envgen_usd.xml_events import safe_parser

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
    """Returns the content of a URL.

    Raises:
        EnvgenError: The download fails.
    """
    request = urllib.request.Request(address, headers={"User-Agent": "envgen-usd"})
    try:
        with urllib.request.urlopen(request, timeout=_TIMEOUT) as answer:
            body: bytes = answer.read()
    except (urllib.error.URLError, OSError) as error:
        raise EnvgenError(
            f"{address}: the schema cannot be downloaded ({error}); give --schemas FOLDER with "
            "the schemas of CityGML, or --no-schema to check geometry and references only"
        ) from error
    return body


def cache_folder() -> Path:
    """Cache folder of downloaded schemas."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "envgen-usd" / "schemas"


def load_schema(
    version: str, folder: Path | None = None, fetched_by: Callable[[str], bytes] = fetch
) -> etree.XMLSchema:
    """Returns the schema of all modules of CityGML.

    Args:
        version: ``1.0``, ``2.0`` or ``3.0``.
        folder: Folder with the schemas at any depth; `None` downloads them at first use and keeps
            them in `cache_folder`.
        fetched_by: Returns the content of a URL.

    Raises:
        EnvgenError: The version is unknown, or its schemas are not available.
    """
    if version not in _MODULES:
        raise EnvgenError(
            f"CityGML {version or '(no version)'}: unknown; choose from 1.0, 2.0 and 3.0"
        )
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
    """Copies schemas, with all that they import or include, below a folder."""
    waiting, known = list(places), set(places)
    while waiting:
        place = waiting.pop()
        file = root / place
        if not file.exists():
            _keep(fetched_by(f"https://{place}"), place, file)
        files = {
            _target(place, link.get("schemaLocation", ""))
            for link in _links(etree.parse(file, safe_parser()))
        }
        waiting += sorted(files - known)
        known |= files


def _links(tree: etree._ElementTree) -> list[etree._Element]:
    """Elements that reference other schemas."""
    elements = tree.iter(f"{_XS}import", f"{_XS}include")
    return [element for element in elements if element.get("schemaLocation")]


def _target(place: str, name: str) -> str:
    """Host and path of a schema that another schema references."""
    if "://" in name:
        parts = urlsplit(name)
        return f"{parts.netloc}{parts.path}"
    return posixpath.normpath(posixpath.join(posixpath.dirname(place), name))


def _keep(body: bytes, place: str, file: Path) -> None:
    """Saves a schema with relative references, so that later runs need no network."""
    try:
        tree = etree.ElementTree(etree.fromstring(body, safe_parser()))
    except etree.XMLSyntaxError as error:
        raise EnvgenError(
            f"https://{place}: the response is not a schema: {one_line(error)}"
        ) from error
    for link in _links(tree):
        target = _target(place, link.get("schemaLocation", ""))
        link.set("schemaLocation", posixpath.relpath(target, posixpath.dirname(place)))
    make_folder(file.parent)
    write_whole(file, etree.tostring(tree))


def _find(version: str, folder: Path) -> dict[str, Path]:
    """File of each module's schema by its namespace, at any depth of the folder."""
    by_namespace = {}
    for namespace, place in _places(version).items():
        mark = f'targetNamespace="{namespace}"'
        files = sorted(folder.rglob(place.rpartition("/")[2]))
        matching = [file for file in files if mark in file.read_text("utf-8", errors="replace")]
        if not matching:
            raise EnvgenError(f"{folder}: holds no schema of {namespace}")
        by_namespace[namespace] = matching[0]
    return by_namespace


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
