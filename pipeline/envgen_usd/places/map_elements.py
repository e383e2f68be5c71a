"""Counts of the elements of a map: what each is used for, and what nothing follows from."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import osmium
from osmium.osm import Node, Relation, Way

from envgen_usd.errors import Issue, Severity
from envgen_usd.places.osm_place import has_body
from envgen_usd.places.osm_streets import Bounds, is_street, point_use, restricted_turn
from envgen_usd.places.osm_tags import has_shop_front, line_kind

_MAIN = (
    *("highway", "building", "building:part", "railway", "waterway", "landuse", "natural"),
    *("leisure", "amenity", "shop", "barrier", "power", "man_made", "public_transport"),
    *("emergency", "tourism", "historic", "place", "boundary", "route", "restriction", "type"),
)
"""Keys that say what an element is, the most telling first."""
_MOST = 12
"""Kinds of unused elements that are named; the others are counted."""


class HasLanduse(Protocol):
    """Tells what landuse follows from."""

    def __call__(self, tags: Mapping[str, str], *, is_area: bool) -> bool:
        """True for tags of an area, or else of a line, that have a class."""


@dataclass(frozen=True)
class MapElements:
    """The elements of an extract; each is counted once.

    Attributes:
        total: Nodes, ways and relations of the file.
        places: Elements without tags: points and members of others.
        outside: Elements with tags beyond the area that was asked for.
        used: Others by what they are used for.
        unused: Others by what they are.
    """

    total: int
    places: int
    outside: int
    used: Mapping[str, int]
    unused: Mapping[str, int]

    def issues(self, source: str) -> Iterator[Issue]:
        """What was used, and what was not."""
        text = f"of {self.total} nodes, ways and relations, {self.places} have no tags"
        text += f", {self.outside} lie outside of --bbox" * bool(self.outside)
        text += f", {sum(self.used.values())} are used: {_listed(self.used)}"
        yield Issue("osm.elements", Severity.INFO, source, text, "used")
        if self.unused:
            text = f"from {sum(self.unused.values())} elements nothing follows: "
            yield Issue(
                "osm.unused", Severity.INFO, source, text + _listed(self.unused), "left out"
            )


def count_elements(
    path: Path, has_landuse: HasLanduse, bounds: Bounds | None = None
) -> MapElements:
    """Counts the elements of an extract that other readers have read without an error.

    Args:
        path: The extract.
        has_landuse: Tells what has a class of landuse.
        bounds: Area that was taken; `None`: all of it.
    """
    used, unused = Counter[str](), Counter[str]()
    total = places = outside = 0
    inside: set[tuple[str, int]] = set()
    for item in osmium.FileProcessor(str(path)).with_locations():
        total += 1
        tags = {tag.k: tag.v for tag in item.tags}
        is_inside = bounds is None or _is_inside(item, bounds, inside)
        if is_inside and bounds is not None and isinstance(item, Node | Way):
            inside.add(("n" if isinstance(item, Node) else "w", item.id))
        if not tags:
            places += 1
        elif not is_inside:
            outside += 1
        elif use := _use(item, tags, has_landuse):
            used[use] += 1
        else:
            unused[_kind(tags)] += 1
    return MapElements(total, places, outside, used, unused)


def _is_inside(item: object, bounds: Bounds, inside: set[tuple[str, int]]) -> bool:
    """True for a node in the area, and for what has any part there."""
    if isinstance(item, Node):
        west, south, east, north = bounds
        at = item.location
        return at.valid() and west <= at.lon <= east and south <= at.lat <= north
    if isinstance(item, Way):
        return any(("n", node.ref) in inside for node in item.nodes)
    if isinstance(item, Relation):
        return any((member.type, member.ref) in inside for member in item.members)
    return False


def _use(item: object, tags: Mapping[str, str], has_landuse: HasLanduse) -> str:
    """What an element is used for; empty: for nothing."""
    if isinstance(item, Node):
        return point_use(tags) or ("shops" if has_shop_front(tags) else "")
    if isinstance(item, Way):
        return _use_of_way(tags, has_landuse, is_closed=item.is_closed())
    return _use_of_relation(item, tags, has_landuse) if isinstance(item, Relation) else ""


def _use_of_way(tags: Mapping[str, str], has_landuse: HasLanduse, *, is_closed: bool) -> str:
    uses = (
        ("streets", is_street(tags)),
        ("buildings", has_body(tags)),
        ("barriers, rows of trees and railways", bool(line_kind(tags))),
        ("landuse", has_landuse(tags, is_area=is_closed)),
    )
    return next((name for name, is_so in uses if is_so), "")


def _use_of_relation(relation: Relation, tags: Mapping[str, str], has_landuse: HasLanduse) -> str:
    is_area = tags.get("type") == "multipolygon"
    is_rule = tags.get("type") == "restriction" and "restriction" in tags
    uses = (
        ("restrictions", is_rule and restricted_turn(relation) is not None),
        ("buildings", is_area and has_body(tags)),
        ("landuse", is_area and has_landuse(tags, is_area=True)),
    )
    return next((name for name, is_so in uses if is_so), "")


def _kind(tags: Mapping[str, str]) -> str:
    key = next((key for key in _MAIN if key in tags), min(tags))
    return f"{key}={tags[key]}" if key in _MAIN else key


def _listed(counts: Mapping[str, int]) -> str:
    order = sorted(counts.items(), key=lambda each: (-each[1], each[0]))
    shown = [f"{count} {name}" for name, count in order[:_MOST]]
    rest = order[_MOST:]
    if rest:
        shown.append(f"{sum(count for _, count in rest)} of {len(rest)} other kinds")
    return ", ".join(shown)
