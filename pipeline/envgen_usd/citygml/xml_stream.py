"""Reads CityGML files as streams of XML elements, in little memory and without the network."""

from collections.abc import Iterator
from pathlib import Path

from lxml import etree

from envgen_usd.compressed_files import open_content
from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.xml_events import local_name, safe_iterparse

MEMBERS = ("cityObjectMember", "featureMember")
"""Properties of a city model that hold features."""


def stream_elements(
    path: Path, *names: str, events: tuple[str, ...] = ("end",)
) -> Iterator[tuple[str, etree._Element]]:
    """Yields events and elements of a CityGML file, in file order.

    The parser is that of `safe_iterparse`. The caller frees the elements with `forget`.

    Args:
        path: The file, plain or packed.
        names: Local names of the elements; none means all elements.
        events: ``start``, ``end``, or both.

    Raises:
        EnvgenError: The file cannot be read, is not XML, declares entities, or has another root
            than ``CityModel``.
    """
    tags = tuple(f"{{*}}{name}" for name in names)
    try:
        with open_content(path) as file:
            stream = safe_iterparse(file, events, tags or None)
            yield from stream
            if stream.root is None or local_name(stream.root) != "CityModel":
                raise EnvgenError(f"{path}: not CityGML: its root element is not CityModel")
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror or error}") from error
    except etree.XMLSyntaxError as error:
        raise EnvgenError(f"{path}: is not well-formed XML: {one_line(error)}") from error


def stream_members(path: Path, *more: str) -> Iterator[etree._Element]:
    """Yields the members of a city model, which live until the next, and other elements by name.

    Args:
        path: CityGML of any version.
        more: Local names of the other elements, wherever they are.

    Raises:
        EnvgenError: As for `stream_elements`.
    """
    for _, element in stream_elements(path, *MEMBERS, "appearanceMember", *more):
        is_member = local_name(element).endswith("Member")
        parent = element.getparent()
        if parent is None or (is_member and local_name(parent) != "CityModel"):
            continue
        yield element
        if is_member:
            forget(element)


def other_file(path: Path, name: str) -> Path:
    """File with members that a city model names.

    Raises:
        EnvgenError: It lies outside of the folder of the city model.
    """
    folder = path.parent.resolve()
    try:
        inside = (folder / name).resolve().is_relative_to(folder)
    except (OSError, RuntimeError, ValueError):  # links in a circle, or no name of a file
        inside = False
    if not inside:
        raise EnvgenError(
            f"{path}: refers to members in {name!r}, outside of its folder; copy the file there"
        )
    return path.parent / name


def forget(element: etree._Element) -> None:
    """Frees an element and those before it, so that memory does not grow with the file."""
    element.clear()
    parent = element.getparent()
    while parent is not None and element.getprevious() is not None:
        del parent[0]
