"""Parses an untrusted OpenDRIVE file into a tree of elements.

1. Only regular files of at most `LARGEST_FILE` bytes are read, also after unpacking; an included
   file is never unpacked.
2. The parser resolves no entities and never uses the network. Files with entities or external
   document types are refused.
3. Includes stay inside the folder of the file (`includes`).
4. Of a truncated file, such as an interrupted download, the complete elements are used.
5. Elements in the standard's namespaces lose their prefix, so the readers know a single name.
"""

import copy
import re
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from envgen_usd.compressed_files import is_packed, read_content
from envgen_usd.errors import EnvgenError, Severity, one_line
from envgen_usd.opendrive.document.findings import Element, Findings
from envgen_usd.xml_events import local_name, namespace_of, refuse_entities, safe_parser

LARGEST_FILE = 512 * 1024 * 1024
"""Largest file size in bytes; larger files are refused."""
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")
_SUFFIX = "Give an OpenDRIVE file (.xodr)"


@dataclass(frozen=True)
class Document:
    """A parsed file.

    Attributes:
        path: Path of the file.
        root: The OpenDRIVE element.
        namespace: Former namespace of the elements; empty if they had no namespace.
    """

    path: Path
    root: Element
    namespace: str


def open_document(path: Path, findings: Findings) -> Document:
    """Opens an OpenDRIVE file.

    Args:
        path: The file, .xodr, .xodr.gz or .xodr.bz2.
        findings: Collects the issues.

    Raises:
        EnvgenError: The file is missing, not XML, not OpenDRIVE, or hostile.
    """
    tree = parse(path, findings)
    root = tree.getroot()
    namespace = strip_namespace(root)
    if root.tag != "OpenDRIVE":
        if root.find("road/planView") is None:
            raise EnvgenError(f"{path}: the root element is {root.tag}, not OpenDRIVE. {_SUFFIX}.")
        text = f"the root element is {root.tag}"
        findings.repaired("root.name", root, text, "treated as OpenDRIVE", Severity.ERROR)
        root.tag = "OpenDRIVE"
    return Document(path, root, namespace)


def parse(path: Path, findings: Findings, *, packed: bool = True) -> etree._ElementTree:
    """Parses an XML file without access to anything outside the file.

    Args:
        path: The file.
        findings: Collects the issues.
        packed: False to refuse a packed file.

    Raises:
        EnvgenError: The file cannot be read, is not XML, or defines entities.
    """
    data = _read(path, packed=packed)
    try:
        root = _parse(data, findings)
    except etree.XMLSyntaxError as error:
        line, reason = error.lineno or 0, one_line(error).split(",")[0].strip()
        recovered = _recover(data)
        if recovered is None:
            what = f"{path}: not valid XML: line {line}: {reason}"
            raise EnvgenError(f"{what}. {_SUFFIX}.") from None
        root = recovered
        text, action = f"line {line}: {reason}", "only complete elements are used"
        findings.repaired("file.broken", root, text, action, Severity.ERROR)
    tree = root.getroottree()
    refuse_entities(tree, path)
    return tree


def _parse(data: bytes, findings: Findings) -> Element:
    parser = safe_parser()
    try:
        return etree.fromstring(data, parser)
    except etree.XMLSyntaxError:
        if _is_unicode(data):
            raise
    text = _DECLARATION.sub("", data.decode("latin-1"))
    root = etree.fromstring(text.encode(), parser)
    findings.repaired("file.encoding", root, "not in the declared encoding", "read as Latin-1")
    return root


def _recover(data: bytes) -> Element | None:
    """Returns the root of a truncated file without its last, unfinished part.

    `None` for a file without a complete road, or for a file that is hostile or has names that XML
    does not allow, and so is more than truncated.
    """
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        return None
    root = etree.fromstring(data, safe_parser(recover=True))
    if root is None or len(root) == 0:
        return None
    if not data.rstrip().endswith(f"</{local_name(root)}>".encode()):
        root.remove(root[-1])
    try:
        names = {each: etree.QName(each).localname for each in root.iter("*")}
    except ValueError:  # a name that XML does not allow: more than the end is damaged
        return None
    return root if any(names[each] == "road" for each in root.iterchildren("*")) else None


def _is_unicode(data: bytes) -> bool:
    try:
        data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.startswith((b"\xff\xfe", b"\xfe\xff"))
    return True


def _read(path: Path, *, packed: bool) -> bytes:
    if not path.exists():
        raise EnvgenError(f"{path}: there is no such file. {_SUFFIX}.")
    if not path.is_file():
        raise EnvgenError(f"{path}: not a regular file. {_SUFFIX}.")
    size = path.stat().st_size
    if size > LARGEST_FILE:
        limit = LARGEST_FILE >> 20
        raise EnvgenError(f"{path}: {size >> 20} MiB; at most {limit} MiB are read. Split the map.")
    try:
        if not packed and is_packed(path):
            raise EnvgenError(f"{path}: an included file is packed. Unpack it.")
        data = read_content(path, LARGEST_FILE).lstrip()
    except OSError as error:
        what = f"{path}: cannot be read: {error.strerror}"
        raise EnvgenError(f"{what}. Check its permissions.") from None
    if not data:
        raise EnvgenError(f"{path}: the file is empty. {_SUFFIX}.")
    return data


def strip_namespace(root: Element) -> str:
    """Removes the root's namespace from all elements in it, and returns the namespace."""
    namespace = namespace_of(root)
    if not namespace:
        return ""
    prefix = f"{{{namespace}}}"
    for element in root.iter(f"{prefix}*"):
        element.tag = str(element.tag)[len(prefix) :]
    return namespace


def restore_namespace(document: Document) -> Element:
    """Returns a copy of the document's root with the namespace restored."""
    root = copy.deepcopy(document.root)
    if document.namespace:
        for element in root.iter("*"):
            if not str(element.tag).startswith("{"):
                element.tag = f"{{{document.namespace}}}{element.tag}"
    return root
