"""The XML schemas of CityGML: from a folder, or fetched once from the standard's address."""

import os
import urllib.error
import urllib.request
from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import urljoin, urlsplit

from lxml import etree

from envgen_usd.errors import EnvgenError

_ADDRESS = "https://schemas.opengis.net/citygml"
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
            f"{address}: the schema cannot be fetched ({error}); name a folder that holds the"
            " schemas of CityGML, or try again with a network"
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
        addresses = _addresses(version)
        _mirror(addresses.values(), root, fetched_by)
        files = {name: root / _local(address) for name, address in addresses.items()}
    else:
        root, files = folder, _find(version, folder)
    return _compile(files, root)


def _addresses(version: str) -> dict[str, str]:
    """Address of each module's schema by its namespace."""
    modules = {
        f"{_NAMESPACE}/{module}/{version}": f"{_ADDRESS}/{module}/{version}/{file}"
        for module, file in _MODULES[version].items()
    }
    return {f"{_NAMESPACE}/{version}": f"{_ADDRESS}/{version}/{_CORE[version]}", **modules}


def _local(address: str) -> str:
    parts = urlsplit(address)
    return f"{parts.netloc}{parts.path}"


def _mirror(addresses: Iterable[str], root: Path, fetched_by: Callable[[str], bytes]) -> None:
    """Copies schemas, and those that they import or include, into folders named by address."""
    waiting, known = list(addresses), set(addresses)
    while waiting:
        address = waiting.pop()
        file = root / _local(address)
        if not file.exists():
            body = fetched_by(address)
            file.parent.mkdir(parents=True, exist_ok=True)
            part = file.with_name(f".{file.name}.{os.getpid()}")
            part.write_bytes(body)
            part.replace(file)
        try:
            tree = etree.parse(str(file))
        except etree.XMLSyntaxError as error:
            file.unlink()
            raise EnvgenError(f"{address}: what is there is no schema: {error}") from error
        for link in tree.iter(f"{_XS}import", f"{_XS}include"):
            target = urljoin(address, link.get("schemaLocation", address))
            if target not in known:
                known.add(target)
                waiting.append(target)


def _find(version: str, folder: Path) -> dict[str, Path]:
    """File of each module's schema by its namespace, wherever it lies in the folder."""
    found = {}
    for namespace, address in _addresses(version).items():
        mark = f'targetNamespace="{namespace}"'
        files = sorted(folder.rglob(address.rpartition("/")[2]))
        matching = [file for file in files if mark in file.read_text("utf-8", errors="replace")]
        if not matching:
            raise EnvgenError(f"{folder}: holds no schema of {namespace}")
        found[namespace] = matching[0]
    return found


class _Mirrored(etree.Resolver):
    """Turns addresses of the web into the files that stand for them."""

    def __init__(self, root: Path) -> None:
        super().__init__()
        self._root = root

    def resolve(self, system_url: str, public_id: str, context: object) -> object:
        file = self._root / _local(system_url)
        if urlsplit(system_url).scheme in ("http", "https") and file.exists():
            return self.resolve_filename(str(file), context)
        return None


def _compile(files: dict[str, Path], root: Path) -> etree.XMLSchema:
    imports = "".join(
        f'<xs:import namespace="{namespace}" schemaLocation="{file.resolve().as_uri()}"/>'
        for namespace, file in files.items()
    )
    text = (
        '<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="urn:envgen-usd">'
        f"{imports}</xs:schema>"
    )
    parser = etree.XMLParser(no_network=True)
    parser.resolvers.add(_Mirrored(root))
    try:
        return etree.XMLSchema(etree.fromstring(text, parser))
    except etree.XMLSchemaParseError as error:
        raise EnvgenError(f"{root}: the schemas cannot be used: {error}") from error
