"""Events of XML files that others wrote, which may mean harm.

A file that declares entities is refused, whether they stand for much (an entity bomb) or for
another file. No document type is loaded, nothing is fetched, and libxml2 keeps its limits on depth
and length.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, cast

from lxml import etree

from envgen_usd.errors import EnvgenError

_HARDENED: dict[str, Any] = {
    "resolve_entities": False,
    "no_network": True,
    "load_dtd": False,
    "dtd_validation": False,
    "attribute_defaults": False,
    "huge_tree": False,
}


class XmlEvents:
    """Events of a file: pairs of ``start`` or ``end`` and an element; see `safe_iterparse`."""

    def __init__(self, file: BinaryIO, events: Sequence[str], tag: Sequence[str] | None) -> None:
        """Prepares the parser; nothing is read yet."""
        self._file = file
        self._events = etree.iterparse(
            file, events=events, tag=tag, remove_comments=True, remove_pis=True, **_HARDENED
        )

    @property
    def root(self) -> etree._Element | None:
        """The root, `None` until the file has been read to its end."""
        return cast("etree._Element | None", self._events.root)

    def __iter__(self) -> Iterator[tuple[str, etree._Element]]:
        """Reads on; elements come when they begin or end."""
        checked = False
        for event, element in self._events:
            if not checked:
                refuse_entities(element.getroottree(), self._file.name)
                checked = True
            yield event, element


def safe_iterparse(
    file: BinaryIO, events: Sequence[str] = ("end",), tag: Sequence[str] | None = None
) -> XmlEvents:
    """Returns the events of an XML file, without its comments and processing instructions.

    Args:
        file: Open for reading, with the name for messages.
        events: ``start``, ``end``.
        tag: Names of the elements that are wanted, e.g. ``{*}CityModel``; `None` for all.

    Returns:
        An iterable, which raises `etree.XMLSyntaxError` where the file is not well-formed and
        `EnvgenError` where it declares entities.
    """
    return XmlEvents(file, events, tag)


def safe_parser(*, recover: bool = False) -> etree.XMLParser:
    """Returns a parser for a whole file or text, as safe as `safe_iterparse`.

    Call `refuse_entities` with what it has parsed.

    Args:
        recover: True to parse what a broken file holds.
    """
    return etree.XMLParser(recover=recover, **_HARDENED)


def refuse_entities(tree: etree._ElementTree, path: Path | str) -> None:
    """Refuses a file that declares entities, or an external document type that might.

    Args:
        tree: What has been parsed so far, with the document type.
        path: Its file, for the message.

    Raises:
        EnvgenError: The file declares one.
    """
    declared: Any = tree.docinfo.internalDTD
    if declared is None:
        return
    entities = declared.entities()
    if entities or declared.system_url or declared.external_id:
        what = f"entity {entities[0].name}" if entities else "an external document type"
        raise EnvgenError(f"{path}: declares {what}, refused. Remove the DOCTYPE from the file.")


def local_name(element: etree._Element) -> str:
    """Name of an element without its namespace.

    Names need not be those that XML allows: a prefix that is not declared stays in the name.
    """
    name: str = element.tag.rpartition("}")[2]
    return name


def namespace_of(element: etree._Element) -> str:
    """Namespace of an element; empty without one."""
    name: str = element.tag.rpartition("}")[0]
    return name.removeprefix("{")
