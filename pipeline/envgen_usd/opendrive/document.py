"""An OpenDRIVE file as a tree of elements, opened without trust.

1. Only a regular file of at most `LARGEST_FILE` bytes is read, and only as it is (a packed file
   could unfold to any size).
2. Entities and document type declarations that define or load something are refused; the parser
   resolves none and never uses the network.
3. Includes are followed inside the file's own folder only (`includes`).
4. Of a file that breaks off, as after a broken download, what is whole is used.
5. Elements of the standard's namespaces lose their prefix, so that the readers know one name each.
"""

import copy
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lxml import etree

from envgen_usd.errors import EnvgenError, Severity
from envgen_usd.opendrive.findings import Element, Findings

LARGEST_FILE = 512 * 1024 * 1024
"""Bytes beyond which a file is refused."""
_PACKED = (b"\x1f\x8b", b"PK\x03\x04", b"BZh", b"\xfd7zXZ", b"(\xb5/\xfd")
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")
_SUFFIX = "Give an OpenDRIVE file (.xodr)"


@dataclass(frozen=True)
class Document:
    """An opened file.

    Attributes:
        path: Where it was read from.
        root: The OpenDRIVE element.
        namespace: Namespace that its elements had, empty if they had none.
    """

    path: Path
    root: Element
    namespace: str


def open_document(path: Path, findings: Findings) -> Document:
    """Opens an OpenDRIVE file.

    Args:
        path: The file.
        findings: Takes the issues.

    Raises:
        EnvgenError: There is no such file, it is no XML, no OpenDRIVE, or hostile.
    """
    tree = parse(path, findings)
    root = tree.getroot()
    namespace = strip_namespace(root)
    if root.tag != "OpenDRIVE":
        if root.find("road/planView") is None:
            raise EnvgenError(f"{path}: the root element is {root.tag}, not OpenDRIVE. {_SUFFIX}.")
        text = f"the root element is {root.tag}"
        findings.mended("root.name", root, text, "taken as OpenDRIVE", Severity.ERROR)
        root.tag = "OpenDRIVE"
    return Document(path, root, namespace)


def parse(path: Path, findings: Findings) -> etree._ElementTree:
    """Parses an XML file without resolving anything outside it.

    Raises:
        EnvgenError: The file cannot be read, is no XML, or defines entities.
    """
    data = _read(path)
    try:
        root = _parse(data, findings)
    except etree.XMLSyntaxError as error:
        line, reason = error.lineno or 0, str(error.msg).split(",")[0]
        recovered = _recover(data)
        if recovered is None:
            what = f"{path}: no XML that can be read: line {line}: {reason}"
            raise EnvgenError(f"{what}. {_SUFFIX}.") from None
        root = recovered
        text, action = f"line {line}: {reason}", "only what is whole in it is used"
        findings.mended("file.broken", root, text, action, Severity.ERROR)
    tree = root.getroottree()
    _refuse_entities(tree, path)
    return tree


def _parse(data: bytes, findings: Findings) -> Element:
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False
    )
    try:
        return etree.fromstring(data, parser)
    except etree.XMLSyntaxError:
        if _is_unicode(data):
            raise
    text = _DECLARATION.sub("", data.decode("latin-1"))
    root = etree.fromstring(text.encode(), parser)
    findings.mended("file.encoding", root, "not in the declared encoding", "read as Latin-1")
    return root


def _recover(data: bytes) -> Element | None:
    """What a file holds before it breaks off, without its last, unfinished part.

    Nothing if there is no whole road, or if the file is not broken but hostile.
    """
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        return None
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, recover=True
    )
    root = etree.fromstring(data, parser)
    if root is None or len(root) == 0:
        return None
    if not data.rstrip().endswith(f"</{etree.QName(root).localname}>".encode()):
        root.remove(root[-1])
    whole = any(etree.QName(each).localname == "road" for each in root.iterchildren("*"))
    return root if whole else None


def _is_unicode(data: bytes) -> bool:
    try:
        data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.startswith((b"\xff\xfe", b"\xfe\xff"))
    return True


def _read(path: Path) -> bytes:
    if not path.exists():
        raise EnvgenError(f"{path}: there is no such file. {_SUFFIX}.")
    if not path.is_file():
        raise EnvgenError(f"{path}: not a regular file. {_SUFFIX}.")
    size = path.stat().st_size
    if size > LARGEST_FILE:
        limit = LARGEST_FILE >> 20
        raise EnvgenError(f"{path}: {size >> 20} MiB; at most {limit} MiB are read. Split the map.")
    try:
        data = path.read_bytes().lstrip()
    except OSError as error:
        what = f"{path}: cannot be read: {error.strerror}"
        raise EnvgenError(f"{what}. Check its permissions.") from None
    if not data:
        raise EnvgenError(f"{path}: the file is empty. {_SUFFIX}.")
    if data.startswith(_PACKED):
        raise EnvgenError(f"{path}: a packed file. Unpack it and give the .xodr inside.")
    return data


def _refuse_entities(tree: etree._ElementTree, path: Path) -> None:
    declared: Any = tree.docinfo.internalDTD
    if declared is None:
        return
    entities = declared.entities()
    if entities or declared.system_url or declared.external_id:
        what = f"entity {entities[0].name}" if entities else "an external document type"
        raise EnvgenError(f"{path}: declares {what}, refused. Remove the DOCTYPE from the file.")


def strip_namespace(root: Element) -> str:
    """Takes the root's namespace off all elements that have it, and returns it."""
    name = etree.QName(root)
    if not name.namespace:
        return ""
    prefix = f"{{{name.namespace}}}"
    for element in root.iter(f"{prefix}*"):
        element.tag = str(element.tag)[len(prefix) :]
    return name.namespace


def restore_namespace(document: Document) -> Element:
    """A copy of the document's root whose elements have their namespace again."""
    root = copy.deepcopy(document.root)
    if document.namespace:
        for element in root.iter("*"):
            if not str(element.tag).startswith("{"):
                element.tag = f"{{{document.namespace}}}{element.tag}"
    return root
