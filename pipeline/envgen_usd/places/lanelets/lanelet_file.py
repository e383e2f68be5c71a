"""Reads the XML of a Lanelet2 map: nodes, ways and relations with their tags."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lxml import etree

from envgen_usd.compressed_files import open_content
from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.input_paths import check_input_file
from envgen_usd.xml_events import safe_iterparse

_MOST = 5_000_000
"""Largest number of nodes; a larger value lets a file take more memory (about 1 kB a node)."""
_LARGEST = 2**63 - 1
"""Largest id, as Lanelet2 keeps ids."""
_MEMBERS = frozenset(("node", "way", "relation"))
_NAN = float("nan")


@dataclass(frozen=True)
class MapMember:
    """A member of a relation: ``node``, ``way`` or ``relation``, its id, and its role."""

    type: str
    id: int
    role: str


@dataclass(frozen=True)
class MapRelation:
    """A relation with its members and tags."""

    id: int
    members: tuple[MapMember, ...]
    tags: Mapping[str, str]

    @property
    def is_lanelet(self) -> bool:
        """Whether it is a lanelet."""
        return self.tags.get("type") == "lanelet"

    def of(self, role: str) -> tuple[MapMember, ...]:
        """Members of a role."""
        return tuple(member for member in self.members if member.role == role)


@dataclass
class LaneletFile:
    """What a file holds.

    Attributes:
        nodes: Id to latitude, longitude, x, y and height; NaN where the file has no number.
        ways: Id to the ids of its nodes and its tags.
        relations: Relations by id.
        repeated: Elements whose id an earlier one has.
        unreadable: Elements without a usable id.
    """

    nodes: dict[int, tuple[float, float, float, float, float]] = field(default_factory=dict)
    ways: dict[int, tuple[tuple[int, ...], Mapping[str, str]]] = field(default_factory=dict)
    relations: dict[int, MapRelation] = field(default_factory=dict)
    repeated: int = 0
    unreadable: int = 0


def read_lanelet_file(path: Path) -> LaneletFile:
    """Reads a Lanelet2 map, also packed with gzip or bzip2.

    Raises:
        EnvgenError: The file is no OSM XML, declares entities, or has too many nodes.
    """
    check_input_file(path, "name a Lanelet2 map", "--lanelet2")
    content = LaneletFile()
    try:
        with open_content(path) as file:
            events = safe_iterparse(file, ("start", "end"))
            for number, (event, element) in enumerate(events):
                if number == 0 and element.tag != "osm":
                    raise EnvgenError(
                        f"{path}: no Lanelet2 map; its root element is {element.tag}, not osm"
                    )
                if event == "end" and element.tag in _MEMBERS:
                    _add(element, content)
                    _forget(element)
                    if len(content.nodes) > _MOST:
                        raise EnvgenError(f"{path}: more than {_MOST} nodes; cut the map")
    except (etree.XMLSyntaxError, OSError) as error:
        raise EnvgenError(f"{path}: no Lanelet2 map: {one_line(error)}") from error
    return content


def _forget(element: etree._Element) -> None:
    element.clear()
    parent = element.getparent()
    if parent is not None:
        while element.getprevious() is not None:
            del parent[0]


def _add(element: etree._Element, content: LaneletFile) -> None:
    if element.get("action") == "delete":
        return
    number = whole(element.get("id"))
    if number is None:
        content.unreadable += 1
        return
    kept: Mapping[int, object] = getattr(content, f"{element.tag}s")
    if number in kept:
        content.repeated += 1
        return
    tags = {tag.get("k", ""): tag.get("v", "") for tag in element.iterchildren("tag")}
    if element.tag == "node":
        values = (element.get("lat"), element.get("lon"))
        more = (tags.get(key) for key in ("local_x", "local_y", "ele"))
        lat, lon, x, y, z = (number_of(value) for value in (*values, *more))
        content.nodes[number] = (lat, lon, x, y, z)
    elif element.tag == "way":
        nodes = (whole(each.get("ref")) for each in element.iterchildren("nd"))
        content.ways[number] = tuple(-1 if n is None else n for n in nodes), tags
    else:
        members = []
        for each in element.iterchildren("member"):
            ref = whole(each.get("ref"))
            if ref is not None:
                members.append(MapMember(each.get("type", ""), ref, each.get("role", "")))
        content.relations[number] = MapRelation(number, tuple(members), tags)


def whole(text: str | None) -> int | None:
    """A whole number of 64 bits, or `None`."""
    try:
        value = int(text) if text is not None and len(text) <= 20 else None
    except ValueError:
        return None
    return value if value is not None and abs(value) <= _LARGEST else None


def number_of(text: str | None) -> float:
    """A finite number, or NaN."""
    try:
        value = float(text) if text is not None else _NAN
    except ValueError:
        return _NAN
    return value if math.isfinite(value) else _NAN
