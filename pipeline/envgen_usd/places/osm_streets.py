"""Reads the streets for motor vehicles of an OpenStreetMap extract.

libosmium reads the file: it refuses declared entities and fetches nothing.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import osmium
from osmium.osm import Node, Relation, Way

from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_file
from envgen_usd.places.osm_signs import sign_codes
from envgen_usd.places.osm_tags import line_kind
from envgen_usd.places.street_classes import CLASSES

Bounds = tuple[float, float, float, float]
"""West, south, east and north, degrees."""
Places = tuple[tuple[float, float], ...]
"""Longitudes and latitudes, degrees."""
_KEYS = (
    "highway",
    "building",
    "restriction",
    "natural",
    "amenity",
    "historic",
    "man_made",
    "barrier",
    "emergency",
    "traffic_sign",
    "railway",
    "traffic_calming",
)
_POINTS: Mapping[str, str] = {
    "traffic_signals": "signals",
    "stop": "stop",
    "give_way": "give_way",
}
_BESIDE: Mapping[tuple[str, str], str] = {
    ("natural", "tree"): "tree",
    ("highway", "street_lamp"): "lamp",
    ("amenity", "bench"): "bench",
    ("amenity", "waste_basket"): "bin",
    ("amenity", "post_box"): "mailbox",
    ("amenity", "telephone"): "phone_box",
    ("amenity", "bicycle_parking"): "bicycle_rack",
    ("amenity", "fountain"): "fountain",
    ("historic", "monument"): "monument",
    ("man_made", "crane"): "crane",
    ("emergency", "fire_hydrant"): "hydrant",
    ("barrier", "bollard"): "bollard",
    ("barrier", "gate"): "gate",
    ("barrier", "lift_gate"): "gate",
    ("barrier", "swing_gate"): "gate",
    ("barrier", "sliding_gate"): "gate",
    ("barrier", "entrance"): "gate",
    ("barrier", "cycle_barrier"): "gate",
    ("barrier", "kissing_gate"): "gate",
}
"""Tags of what stands beside streets and in lines."""
_ZEBRA = frozenset({"zebra", "marked", "uncontrolled"})
_BARE = frozenset({"unmarked", "no", "traffic_signals"})
_DIRECTIONS: Mapping[str, int] = {"forward": 1, "backward": -1}
_EARTH = 6_371_000.0


@dataclass(frozen=True)
class MapWay:
    """A way of the map.

    Attributes:
        id: Its id; a way that the area cuts in several has several.
        nodes: Ids of its nodes; negative where the area's border cuts it.
        places: Longitude and latitude of each.
        tags: Its tags.
    """

    id: int
    nodes: tuple[int, ...]
    places: tuple[tuple[float, float], ...]
    tags: Mapping[str, str]


@dataclass
class StreetExtract:
    """What an extract says about streets.

    Attributes:
        ways: Streets.
        points: Id, kind, longitude and latitude, and direction of crossings, signals and signs.
        beside: Kind, longitude and latitude of trees, lamps, benches and others.
        signs: Node, code, longitude and latitude, and direction of traffic signs.
        lines: Tags of hedges, fences, walls, rows of trees and railways, with their nodes' places.
        buildings: Longitude and latitude of the corners of each building, closed.
        banned: Way, node and way of turns that are not allowed; only those of a single node.
        only: Way, node and way of turns that are the only allowed ones.
        unclear_islands: Nodes and ways whose ``crossing:island`` is neither ``yes`` nor ``no``.
        incomplete: Ids of ways that lack nodes.
        clipped: Number of ways that the area cuts or that lie outside of it.
        bounds: Extent of the streets, degrees.
    """

    ways: list[MapWay] = field(default_factory=list)
    points: list[tuple[int, str, tuple[float, float], int]] = field(default_factory=list)
    beside: list[tuple[str, tuple[float, float]]] = field(default_factory=list)
    signs: list[tuple[int, str, tuple[float, float], int]] = field(default_factory=list)
    lines: list[tuple[Mapping[str, str], Places]] = field(default_factory=list)
    buildings: list[list[tuple[float, float]]] = field(default_factory=list)
    banned: list[tuple[int, int, int]] = field(default_factory=list)
    only: list[tuple[int, int, int]] = field(default_factory=list)
    unclear_islands: list[str] = field(default_factory=list)
    incomplete: list[int] = field(default_factory=list)
    clipped: int = 0
    bounds: Bounds = (0.0, 0.0, 0.0, 0.0)


def read_street_extract(
    path: Path, bounds: Bounds | None = None, max_area: float = 25.0
) -> StreetExtract:
    """Reads the streets of an extract: ``.osm``, ``.osm.gz``, ``.osm.bz2`` or ``.pbf``.

    Args:
        path: The extract.
        bounds: Area to take; `None` takes all.
        max_area: Largest extent of the streets, km².

    Raises:
        EnvgenError: The file cannot be read, has no street in the area, crosses the date line, or
            is larger than allowed.
    """
    check_input_file(path, "name an OpenStreetMap extract", "--osm")
    extract = StreetExtract()
    try:
        _read(path, bounds, extract)
    except (RuntimeError, OSError, osmium.InvalidLocationError) as error:
        raise EnvgenError(f"{path}: cannot be read as an OpenStreetMap extract: {error}") from error
    if not extract.ways:
        where = "" if bounds is None else f" within --bbox {','.join(f'{b:g}' for b in bounds)}"
        raise EnvgenError(
            f"{path}: holds no street for motor vehicles{where} (a way with highway=residential or"
            " another class of street)"
        )
    lon, lat = zip(*(place for way in extract.ways for place in way.places), strict=True)
    extract.bounds = (min(lon), min(lat), max(lon), max(lat))
    _check_extent(path, extract.bounds, max_area)
    return extract


def area_of(bounds: Bounds) -> float:
    """Area between parallels and meridians, km²."""
    west, south, east, north = map(math.radians, bounds)
    return _EARTH**2 * (east - west) * (math.sin(north) - math.sin(south)) / 1e6


def _check_extent(path: Path, bounds: Bounds, max_area: float) -> None:
    west, south, east, north = bounds
    if east - west > 180.0:
        raise EnvgenError(
            f"{path}: its streets lie on both sides of the date line; give --bbox W,S,E,N on one"
        )
    if abs(south) > 85.0 or abs(north) > 85.0:
        raise EnvgenError(f"{path}: its streets reach beyond 85 degrees of latitude")
    area = area_of(bounds)
    if area > max_area:
        raise EnvgenError(
            f"{path}: its streets cover {area:.1f} km² ({west:.4f},{south:.4f},{east:.4f},"
            f"{north:.4f}), more than --max-area {max_area:g} km²; give --bbox W,S,E,N or a larger"
            " --max-area"
        )


def _read(path: Path, bounds: Bounds | None, extract: StreetExtract) -> None:
    processor = osmium.FileProcessor(str(path)).with_locations()
    border = _Border(bounds)
    for item in processor.with_filter(osmium.filter.KeyFilter(*_KEYS)):
        tags = {tag.k: tag.v for tag in item.tags}
        if tags.get("crossing:island", "no") not in {"yes", "no"} and isinstance(item, Node | Way):
            kind = "node" if isinstance(item, Node) else "way"
            extract.unclear_islands.append(f"{kind} {item.id}")
        if isinstance(item, Node):
            _add_point(item, tags, bounds, extract)
        elif isinstance(item, Way):
            if is_street(tags):
                _add_way(item, tags, border, extract)
            elif tags.get("building", "no") != "no":
                known = [n.location for n in item.nodes if n.location.valid()]
                if len(known) > 3:
                    extract.buildings.append([(place.lon, place.lat) for place in known])
            elif line_kind(tags):
                _add_line(item, tags, border, extract)
            elif has_island(tags):
                _add_islands(item, bounds, extract)
        elif isinstance(item, Relation) and tags.get("type") == "restriction":
            _add_restriction(item, tags["restriction"], extract)


def _add_point(
    node: Node, tags: Mapping[str, str], bounds: Bounds | None, extract: StreetExtract
) -> None:
    if not node.location.valid():
        return
    place = (node.location.lon, node.location.lat)
    if bounds is not None and not _inside(place, bounds):
        return
    kind = _POINTS.get(tags.get("highway", ""), "")
    if tags.get("highway") == "crossing":
        said = [*tags.get("crossing", "").split(";"), tags.get("crossing_ref", "")]
        marks = tags.get("crossing:markings", "")
        if "traffic_signals" in said:
            extract.points.append((node.id, "signals", place, 0))
        striped = marks in {"zebra", "yes"} or (not marks and not _ZEBRA.isdisjoint(said))
        kind = "zebra" if striped else "crossing"
    for (key, value), beside in _BESIDE.items():
        if tags.get(key) == value:
            extract.beside.append((beside, place))
    way = tags.get("direction", tags.get("traffic_signals:direction", ""))
    along = _DIRECTIONS.get(tags.get("traffic_sign:direction", way), 0)
    for code in sign_codes(tags):
        extract.signs.append((node.id, code, place, along))
    if kind:
        extract.points.append((node.id, kind, place, _DIRECTIONS.get(way, 0)))
    if has_island(tags):
        extract.points.append((node.id, "island", place, 0))


def has_island(tags: Mapping[str, str]) -> bool:
    """True for a crossing, or a way across a street, with an island between the directions."""
    said = {*tags.get("crossing", "").split(";"), *tags.get("traffic_calming", "").split(";")}
    return "island" in said or tags.get("crossing:island") == "yes"


def _add_islands(way: Way, bounds: Bounds | None, extract: StreetExtract) -> None:
    """Takes the nodes of a way across a street; those that are on no street count for nothing."""
    known = {node for node, kind, _, _ in extract.points if kind == "island"}
    for node in way.nodes:
        place = (node.location.lon, node.location.lat) if node.location.valid() else None
        if place and node.ref not in known and (bounds is None or _inside(place, bounds)):
            extract.points.append((node.ref, "island", place, 0))


def _add_line(way: Way, tags: Mapping[str, str], border: "_Border", extract: StreetExtract) -> None:
    """Takes a hedge, fence, wall, row of trees or railway; what the area cuts off is left out."""
    nodes = [(n.ref, (n.location.lon, n.location.lat)) for n in way.nodes if n.location.valid()]
    for run in border.inside(nodes):
        if len(run) > 1:
            extract.lines.append((dict(tags), tuple(place for _, place in run)))


def _add_way(way: Way, tags: Mapping[str, str], border: "_Border", extract: StreetExtract) -> None:
    nodes = [
        (node.ref, (node.location.lon, node.location.lat))
        for node in way.nodes
        if node.location.valid()
    ]
    if len(nodes) < len(way.nodes):
        extract.incomplete.append(way.id)
    # Neighbours at the same place would be edges without a direction.
    nodes = [each for n, each in enumerate(nodes) if n == 0 or each[1] != nodes[n - 1][1]]
    runs = border.inside(nodes)
    extract.clipped += border.bounds is not None and (len(runs) != 1 or len(runs[0]) < len(nodes))
    for run in runs:
        if len(run) > 1:
            ids, places = zip(*run, strict=True)
            extract.ways.append(MapWay(way.id, ids, places, dict(tags)))


def restricted_turn(relation: Relation) -> tuple[int, int, int] | None:
    """Way, node and way of a restriction with one of each; `None` for any other relation."""
    roles: dict[str, list[tuple[str, int]]] = {}
    for member in relation.members:
        roles.setdefault(member.role, []).append((member.type, member.ref))
    if any(len(roles.get(role, [])) != 1 for role in ("from", "via", "to")):
        return None
    if roles["via"][0][0] != "n":
        return None
    return roles["from"][0][1], roles["via"][0][1], roles["to"][0][1]


def is_street(tags: Mapping[str, str]) -> bool:
    """True for a way for motor vehicles."""
    return tags.get("highway") in CLASSES and tags.get("area") != "yes"


def point_use(tags: Mapping[str, str]) -> str:
    """What a node with tags is on or beside a street; empty for all others."""
    if tags.get("highway") == "crossing" or tags.get("highway") in _POINTS:
        return "crossings, signals and priority signs"
    if has_island(tags):
        return "islands"
    if any(tags.get(key) == value for key, value in _BESIDE):
        return "trees, lamps, furniture and gates"
    return "signs" if sign_codes(tags) else ""


def _add_restriction(relation: Relation, kind: str, extract: StreetExtract) -> None:
    """Takes a restriction with one way from, one way to and one node between."""
    turn = restricted_turn(relation)
    if turn is None:
        return
    if kind.startswith("no_"):
        extract.banned.append(turn)
    elif kind.startswith("only_"):
        extract.only.append(turn)


def _inside(place: tuple[float, float], bounds: Bounds) -> bool:
    return bounds[0] <= place[0] <= bounds[2] and bounds[1] <= place[1] <= bounds[3]


class _Border:
    """Cuts ways at the border of an area."""

    def __init__(self, bounds: Bounds | None) -> None:
        self.bounds = bounds
        self._next = -1

    def inside(
        self, nodes: list[tuple[int, tuple[float, float]]]
    ) -> list[list[tuple[int, tuple[float, float]]]]:
        """Runs of a way within the area; new nodes lie on the border."""
        if self.bounds is None:
            return [nodes]
        runs: list[list[tuple[int, tuple[float, float]]]] = []
        for n, (here, after) in enumerate(pairwise(nodes)):
            shares = _clipped(here[1], after[1], self.bounds)
            if shares is None:
                continue
            first, last = (self._at(here, after, share) for share in shares)
            if runs and n and shares[0] == 0.0 and runs[-1][-1] == here:
                runs[-1].append(last)
            else:
                runs.append([first, last])
        return runs

    def _at(
        self,
        here: tuple[int, tuple[float, float]],
        after: tuple[int, tuple[float, float]],
        share: float,
    ) -> tuple[int, tuple[float, float]]:
        if share in {0.0, 1.0}:
            return after if share else here
        self._next -= 1
        (x0, y0), (x1, y1) = here[1], after[1]
        return self._next, (x0 + share * (x1 - x0), y0 + share * (y1 - y0))


def _clipped(
    here: tuple[float, float], after: tuple[float, float], bounds: Bounds
) -> tuple[float, float] | None:
    """Shares of a segment between which it lies in a box (Liang and Barsky); `None` outside."""
    low, high = 0.0, 1.0
    for axis in (0, 1):
        step = after[axis] - here[axis]
        for edge, sign in ((bounds[axis], -1.0), (bounds[axis + 2], 1.0)):
            room = sign * (edge - here[axis])
            if step == 0.0:
                if room < 0.0:
                    return None
                continue
            share = room / (sign * step)
            if sign * step < 0.0:
                low = max(low, share)
            else:
                high = min(high, share)
    return (low, high) if low < high else None
