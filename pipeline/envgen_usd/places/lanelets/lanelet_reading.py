"""A Lanelet2 file ─► `LaneletMap`: bounds that are turned to run along, limits, regulations."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanelet_map import Lanelet, LaneletLine, LaneletMap, Regulation, Side
from envgen_usd.places.lanelets.lanelet_file import (
    LaneletFile,
    MapMember,
    MapRelation,
    number_of,
    read_lanelet_file,
)
from envgen_usd.places.lanelets.node_places import NodePlaces, node_places

_SHORTEST = 0.05
"""Least length of a bound, metres."""
_LONGEST = 20_000.0
"""Largest length of a bound, metres; a larger value lets a wrong node take long to read."""
_WIDEST = 60.0
"""Largest mean width of a lanelet, metres."""
_UNEQUAL = 60.0, 0.3
"""Largest difference in length of the bounds of a lanelet, metres or as a share of the shorter."""
_FASTEST = 300.0
"""Largest speed limit, km/h."""
_MPH = 1.609344
_FOR_ALL = frozenset(("road", "highway", "play_street", "exit"))
"""Subtypes of lanelets for vehicles, where tags of participants do not say otherwise."""
_TWO_WAY = frozenset(("walkway", "shared_walkway", "crosswalk", "stairs", "pedestrian_lane"))
"""Subtypes that run both ways unless a tag says otherwise."""


def read_lanelet_map(path: Path, max_area: float = 25.0) -> LaneletMap:
    """Reads a Lanelet2 map.

    Args:
        path: The file.
        max_area: Largest extent of the lanelets, km².

    Raises:
        EnvgenError: The file is no Lanelet2 map, has no usable lanelet, or is larger than allowed.
    """
    content = read_lanelet_file(path)
    places = node_places(content.nodes, _bounds(content))
    reading = _Reading(path.name, content, places)
    if not reading.lanelets:
        raise EnvgenError(
            f"{path}: holds no usable lanelet (a relation with type=lanelet and a way each as left"
            " and as right member)" + (f"; {reading.first_fault}" if reading.first_fault else "")
        )
    _check_extent(path, reading, max_area)
    return LaneletMap(
        tuple(reading.lines),
        tuple(reading.lanelets),
        reading.regulations(),
        places.crs,
        places.offset,
        path.name,
        tuple(reading.issues()),
        reading.counts(),
    )


def _bounds(content: LaneletFile) -> list[Sequence[int]]:
    """Ids of the nodes of each way that bounds a lanelet."""
    ways = {
        member.id: None
        for relation in content.relations.values()
        if relation.is_lanelet
        for member in relation.members
        if member.role in {"left", "right"} and member.type == "way"
    }
    return [content.ways[way][0] for way in ways if way in content.ways]


def _check_extent(path: Path, reading: "_Reading", max_area: float) -> None:
    used = {side.line for lanelet in reading.lanelets for side in (lanelet.left, lanelet.right)}
    points = np.concatenate([reading.lines[n].points for n in used])
    width, height = np.ptp(points[:, :2], axis=0) / 1000.0
    if width * height > max_area:
        raise EnvgenError(
            f"{path}: its lanelets extend over {width:.1f} x {height:.1f} km, more than --max-area"
            f" {max_area:g} km²; cut the map or allow more"
        )


class _Reading:
    """Reads ways and relations one after the other, and remembers what it leaves out."""

    def __init__(self, source: str, content: LaneletFile, places: NodePlaces) -> None:
        self.source, self.content, self.places = source, content, places
        self.lines: list[LaneletLine] = []
        self.left_out: dict[str, list[int]] = {}
        self.turned: list[int] = []
        self._line_of: dict[int, int] = {}
        self._joined: dict[tuple[int, ...], int] = {}
        self._same: dict[tuple[int, ...], int] = {}
        self._shape: list[tuple[int, ...]] = []
        for number, (nodes, tags) in content.ways.items():
            self._add_line(number, nodes, tags)
        self.lanelets: list[Lanelet] = []
        self._lanelet_of: dict[int, int] = {}
        for relation in content.relations.values():
            if relation.is_lanelet:
                self._add_lanelet(relation)

    @property
    def first_fault(self) -> str:
        """The first reason for which a lanelet was left out."""
        found = next(iter(self.left_out.items()), None)
        return f"lanelet {found[1][0]}: {found[0]}" if found else ""

    def _add_line(self, number: int, nodes: Sequence[int], tags: Mapping[str, str]) -> None:
        rows = [self.places.index[node] for node in nodes if node in self.places.index]
        if len(rows) < len(nodes):
            self.left_out.setdefault("nodes of a way are missing", []).append(number)
        rows = [
            r for n, r in enumerate(rows) if n == 0 or self._place(r) != self._place(rows[n - 1])
        ]
        if len(rows) < 2:
            return
        places = tuple(map(self._place, rows))
        ends = (places[0], places[-1])
        self._line_of[number] = len(self.lines)
        self._same.setdefault(min(places, places[::-1]), len(self.lines))
        self._shape.append(min(places, places[::-1]))
        self.lines.append(LaneletLine(number, self.places.points[rows], ends, tags))

    def _place(self, row: int) -> int:
        return self.places.place[row]

    def _line(self, members: Sequence[MapMember]) -> int | None:
        """The linestring of one or several ways, or `None` where they are no line."""
        numbers = [self._line_of.get(each.id) for each in members if each.type == "way"]
        known = tuple(n for n in numbers if n is not None)
        if not known or len(known) < len(members):
            return None
        if len(known) == 1:
            # Ways over the same places are a single bound, so that neighbours share it.
            return self._same[self._shape[known[0]]]
        if known not in self._joined:
            line = _chained([self.lines[n] for n in known])
            if line is None:
                return None
            self._joined[known] = len(self.lines)
            self.lines.append(line)
        return self._joined[known]

    def _add_lanelet(self, relation: MapRelation) -> None:
        left, right = (self._line(relation.of(role)) for role in ("left", "right"))
        if left is None or right is None or left == right:
            text = "its bounds are missing, incomplete or the same"
            self.left_out.setdefault(text, []).append(relation.id)
            return
        points = self.lines[left].points[:, :2], self.lines[right].points[:, :2]
        if not all(_SHORTEST <= _length(each) <= _LONGEST for each in points):
            text = f"a bound is shorter than {_SHORTEST:g} m or longer than {_LONGEST:g} m"
            self.left_out.setdefault(text, []).append(relation.id)
            return
        lengths = sorted(map(_length, points))
        if lengths[1] - lengths[0] > max(_UNEQUAL[0], _UNEQUAL[1] * lengths[0]):
            text = "a bound is far longer than the other, as with a node that lies far away"
            self.left_out.setdefault(text, []).append(relation.id)
            return
        directions = _directions(*points)
        left_points = points[0] if directions[0] else points[0][::-1]
        right_points = points[1] if directions[1] else points[1][::-1]
        width = _signed_area(left_points, right_points) / max(_length(left_points), 1e-9)
        if not 0.0 < width <= _WIDEST:
            text = f"its bounds are wider apart than {_WIDEST:g} m, or cross"
            self.left_out.setdefault(text, []).append(relation.id)
            return
        if directions[0] != directions[1]:
            self.turned.append(relation.id)
        tags, subtype = relation.tags, _subtype(relation.tags)
        one_way = tags.get("one_way", "no" if subtype in _TWO_WAY else "yes") not in {"no", "false"}
        rules = tuple(m.id for m in relation.of("regulatory_element") if m.type == "relation")
        self._lanelet_of[relation.id] = len(self.lanelets)
        self.lanelets.append(
            Lanelet(
                relation.id,
                Side(left, directions[0]),
                Side(right, directions[1]),
                subtype,
                one_way,
                self._limit(relation, rules),
                tags,
                rules,
            )
        )

    def _limit(self, relation: MapRelation, rules: Sequence[int]) -> float:
        """The speed limit of a lanelet, km/h; 0 without one."""
        for number in rules:
            rule = self.content.relations.get(number)
            if rule is None or rule.tags.get("subtype") != "speed_limit":
                continue
            sign = rule.tags.get("sign_type", "")
            found = speed_of(sign.split("-")[-1] if sign.startswith("de274") else sign)
            if found:
                return found
        return speed_of(relation.tags.get("speed_limit", ""))

    def regulations(self) -> dict[int, Regulation]:
        """Regulatory elements by id."""
        found = {}
        for relation in self.content.relations.values():
            if relation.tags.get("type") != "regulatory_element":
                continue
            lanelets: dict[str, tuple[int, ...]] = {}
            for role in ("right_of_way", "yield"):
                numbers = (self._lanelet_of.get(m.id) for m in relation.of(role))
                lanelets[role] = tuple(n for n in numbers if n is not None)
            found[relation.id] = Regulation(
                relation.id,
                relation.tags.get("subtype", ""),
                self._lines(relation, "refers"),
                self._lines(relation, "ref_line"),
                lanelets,
                relation.tags,
            )
        return found

    def _lines(self, relation: MapRelation, role: str) -> tuple[int, ...]:
        numbers = (self._line_of.get(m.id) for m in relation.of(role) if m.type == "way")
        return tuple(n for n in numbers if n is not None)

    def counts(self) -> dict[str, int]:
        """Numbers of elements by kind."""
        kinds = Counter(r.tags.get("type", "") for r in self.content.relations.values())
        return {
            "nodes": len(self.content.nodes),
            "ways": len(self.content.ways),
            "lanelets": kinds["lanelet"],
            "lanelets_left_out": kinds["lanelet"] - len(self.lanelets),
            "regulatory_elements": kinds["regulatory_element"],
            "areas": kinds["multipolygon"],
        }

    def issues(self) -> Iterator[Issue]:
        """What was left out or repaired."""
        for text, numbers in self.left_out.items():
            what = "way" if text.startswith("nodes") else "lanelet"
            yield Issue(
                "lanelet.left_out" if what == "lanelet" else "lanelet.incomplete_way",
                Severity.WARNING,
                f"{self.source}: {what} {numbers[0]}",
                f"{len(numbers)} {what}s: {text}",
                "left out" if what == "lanelet" else "existing nodes used",
            )
        if self.turned:
            where = f"{self.source}: lanelet {self.turned[0]}"
            text = f"{len(self.turned)} lanelets have bounds that run in opposite directions"
            yield Issue("lanelet.turned", Severity.INFO, where, text, "the right bound was turned")
        if self.places.unusable:
            text = f"{self.places.unusable} nodes have no usable coordinates"
            yield Issue("lanelet.node", Severity.WARNING, self.source, text, "left out")
        for count, what in (
            (self.content.repeated, "have the id of an earlier element"),
            (self.content.unreadable, "have no whole number as id"),
        ):
            if count:
                text = f"{count} elements {what}"
                yield Issue("lanelet.id", Severity.WARNING, self.source, text, "left out")
        if not self.places.crs:
            text = "local coordinates agree with no UTM zone of the nodes' latitudes and longitudes"
            action = "the road file has no geoReference"
            yield Issue("lanelet.no_reference", Severity.INFO, self.source, text, action)
        for count, what in (
            (self.places.without_height, "have no height (ele), others have"),
            (self.places.wrong_heights, "lie far above or below the nodes beside them"),
        ):
            if count:
                text = f"{count} nodes of bounds {what}"
                action = "the nearest node's height used"
                yield Issue("lanelet.height", Severity.WARNING, self.source, text, action)
        if not self.places.heights:
            text = "its nodes have no heights (ele), or equal ones"
            yield Issue("lanelet.level", Severity.INFO, self.source, text, "roads are level")
        areas = Counter(
            r.tags.get("subtype", "(none)")
            for r in self.content.relations.values()
            if r.tags.get("type") == "multipolygon"
        )
        if areas:
            kinds = ", ".join(f"{number} {kind}" for kind, number in sorted(areas.items()))
            text = f"{areas.total()} areas (multipolygons) are no part of a road: {kinds}"
            yield Issue("lanelet.area", Severity.INFO, self.source, text, "not used")


def _subtype(tags: Mapping[str, str]) -> str:
    """Subtype of a lanelet; one for pedestrians or bicycles alone is no road for vehicles."""
    subtype = tags.get("subtype", "road")
    users = {
        key.removeprefix("participant:").split(":")[0]
        for key, value in tags.items()
        if key.startswith("participant:") and value in {"yes", "true"}
    }
    if subtype not in _FOR_ALL or not users or not users <= {"pedestrian", "bicycle"}:
        return subtype
    return "shared_walkway" if "pedestrian" in users else "bicycle_lane"


def speed_of(text: str) -> float:
    """A speed limit such as ``50``, ``50 km/h`` or ``20 mph`` in km/h; 0 where it is none."""
    words = text.lower().replace("km/h", " kmh").replace("m/s", " mps").split()
    value = number_of(words[0]) if words else float("nan")
    unit = words[1] if len(words) > 1 else "kmh"
    value *= {"mph": _MPH, "mps": 3.6}.get(unit, 1.0)
    return value if 0.0 < value <= _FASTEST else 0.0


def _chained(lines: Sequence[LaneletLine]) -> LaneletLine | None:
    """Linestrings joined end to end, in the order of the file; `None` where they do not meet."""
    first, second = lines[:2]
    turned = first.ends[1] not in second.ends
    points = [first.points[::-1] if turned else first.points]
    start, at = first.ends[::-1] if turned else first.ends
    for line in lines[1:]:
        if at not in line.ends:
            return None
        forward = line.ends[0] == at
        points.append((line.points if forward else line.points[::-1])[1:])
        at = line.ends[1] if forward else line.ends[0]
    return LaneletLine(first.id, np.concatenate(points), (start, at), first.tags)


def _directions(left: FloatArray, right: FloatArray) -> tuple[bool, bool]:
    """Whether each bound runs along the lanelet, whose left bound lies on its left.

    The bounds are aligned with each other by their ends, then both are turned where the left one
    lies on the right: the rule of Lanelet2's `geometry::align`. Of rings, which have no ends, the
    inner one is aligned counter-clockwise where it is the left bound.
    """
    if all(np.array_equal(line[0], line[-1]) for line in (left, right)):
        areas = [_ring_area(line) for line in (left, right)]
        counter_clockwise = abs(areas[0]) < abs(areas[1])
        return (areas[0] > 0.0) == counter_clockwise, (areas[1] > 0.0) == counter_clockwise
    along = np.hypot(*(left[0] - right[0])) + np.hypot(*(left[-1] - right[-1]))
    against = np.hypot(*(left[0] - right[-1])) + np.hypot(*(left[-1] - right[0]))
    same = bool(along <= against)
    ordered = right if same else right[::-1]
    forward = _signed_area(left, ordered) > 0.0
    return forward, same == forward


def _signed_area(left: FloatArray, right: FloatArray) -> float:
    """Area of the ring along the right bound and back along the left one; positive if it is so."""
    return _ring_area(np.concatenate([right, left[::-1]]))


def _ring_area(ring: FloatArray) -> float:
    """Area of a ring; positive if it runs counter-clockwise."""
    ring = ring - ring[0]
    after = np.roll(ring, -1, axis=0)
    return 0.5 * float((ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum())


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
