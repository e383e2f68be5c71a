"""Signals, signs, stop lines and crossings of a Lanelet2 map, on the roads of the file."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from lxml import etree

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanelet_map import FOOT, LaneletLine, LaneletMap, Regulation
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.lanelets.lane_groups import border_points
from envgen_usd.streets.lanelets.lanelet_barriers import add_barriers
from envgen_usd.streets.lanelets.lanelet_road_elements import LaneletRoad
from envgen_usd.streets.mapped_furniture import holder

_REACH = 25.0
"""Farthest road of a signal, a sign or a line, metres."""
_HALF = 0.25
"""Half the width of a stop line, metres."""
_LEAST_CROSSING = 2.0
"""Least area of a crossing on roads, m²."""
_LINES = (0.5, 60.0)
"""Least and largest length of a stop line, metres."""
_MARGIN = 0.3
"""Least distance of a signal or a line from the ends of its road, metres."""
_LIGHT = "1000001"
_HIDDEN = frozenset(("virtual", "centerline", "light_bulbs"))
"""Types of linestrings that nobody sees, and the bulbs of lights that are built."""
_SHOWN = frozenset(("traffic_light", "traffic_sign", "right_of_way", "all_way_stop"))
"""Subtypes of regulatory elements whose signs and lights stand beside the road."""
_BUILT = frozenset(("speed_limit", "crosswalk"))
"""Subtypes that other parts of the road follow from: speeds of lanes, crosswalks."""
_TURN = 0.05
"""Angle between a signal's traffic and its road below which it faces the road, radians."""
_HEIGHTS = (1.0, 8.0)
"""Least and largest height of a signal above its road that counts, metres."""
_CODE = re.compile(r"([a-z]{2})[-:]?([0-9.]+)(?:[-\[](.+?)\]?)?")
"""Country, number and sub-number of a sign: ``de205``, ``de274-50``."""


class LaneletFurniture:
    """Adds what regulates traffic to the roads.

    Attributes:
        counts: Numbers of what was added.
        lost: Numbers of what was left out, by kind and reason.
    """

    def __init__(self, roads: Sequence[LaneletRoad], source: LaneletMap) -> None:
        """Prepares the lookup of roads."""
        self._roads, self._source = roads, source
        self.counts: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self._road_of = {
            lanelet: n
            for n, road in enumerate(roads)
            for group in road.strip.groups
            for lanelet in group.lanelets
        }
        self._users: dict[int, list[int]] = defaultdict(list)
        for n, lanelet in enumerate(source.lanelets):
            for number in lanelet.regulations:
                self._users[number].append(n)
        self._areas = np.array([_area(road) for road in roads], object)
        self._tree = shapely.STRtree(self._areas)
        self._done: set[int] = set()

    def add(self) -> None:
        """Adds all objects and signals."""
        for n, lanelet in enumerate(self._source.lanelets):
            if lanelet.subtype == "crosswalk":
                self._add_crossing(n)
        for rule in self._source.regulations.values():
            self._add_rule(rule)
        for n, line in enumerate(self._source.lines):
            if n in self._done:
                continue
            if line.type == "stop_line":
                self._add_stop_line(n, None)
            elif line.type in {"traffic_sign", "traffic_light"}:
                self._add_signal(n, None, line.subtype)
        self.counts += add_barriers(self._roads, self._source)
        self._count_lines()

    def _count_lines(self) -> None:
        """Counts the linestrings with a type that neither bound lanelets nor regulate traffic."""
        bounds = {s.line for each in self._source.lanelets for s in (each.left, each.right)}
        on_foot = {
            side.line
            for each in self._source.lanelets
            if each.subtype in FOOT
            for side in (each.left, each.right)
        }
        for n, line in enumerate(self._source.lines):
            if line.type == "curbstone" and n in bounds - on_foot:
                self.lost["curbstones with no lanelet for pedestrians behind them"] += 1
            if n not in bounds | self._done and line.type and line.type not in _HIDDEN:
                self.lost[f"linestrings of type {line.type} that bound no lanelet"] += 1

    def issues(self) -> Iterator[Issue]:
        """What was added, and what was left out."""
        where = self._source.source
        if self.counts:
            text = ", ".join(f"{number} {kind}" for kind, number in sorted(self.counts.items()))
            yield Issue("lanelet.furniture", Severity.INFO, where, f"beside and on roads: {text}")
        for reason, number in sorted(self.lost.items()):
            yield Issue("lanelet.unused", Severity.INFO, where, f"{number} {reason}", "left out")

    def _add_rule(self, rule: Regulation) -> None:
        users = self._users.get(rule.id, [*rule.lanelets.get("yield", ())])
        on_road = [n for n in users if n in self._road_of]
        user = on_road[0] if on_road else None
        for line in rule.stops:
            if line not in self._done:
                self._add_stop_line(line, user)
        if rule.subtype in _SHOWN:
            for line in rule.refers:
                if line not in self._done:
                    sign = rule.tags.get("sign_type", "")
                    self._add_signal(line, user, self._source.lines[line].subtype or sign)
        elif rule.subtype not in _BUILT:
            self.lost[f"regulatory elements of subtype {rule.subtype or '(none)'}"] += 1

    def _nearest(self, place: FloatArray, user: int | None) -> tuple[int, float, float] | None:
        """Road, s and t of a place: the user's road where it lies beside it, or the nearest."""
        own = None if user is None else self._road_of[user]
        near = self._tree.query(shapely.Point(place), predicate="dwithin", distance=_REACH)
        if own is not None and own not in near:
            near = np.append(near, own)
        best: tuple[tuple[float, ...], tuple[int, float, float]] | None = None
        for n in near.tolist():
            curve = self._roads[n].shape.curve
            s, t = (float(each[0]) for each in curve.located(place[None]))
            beyond = max(-s, s - curve.length, 0.0)
            away = float(shapely.distance(self._areas[n], shapely.Point(place)))
            order = (float(beyond > 0.5), float(n != own), away + beyond)
            margin = min(_MARGIN, curve.length / 2.0)
            inside = float(np.clip(s, margin, curve.length - margin))
            if best is None or order < best[0]:
                best = order, (n, inside, t)
        return None if best is None else best[1]

    def _add_signal(self, number: int, user: int | None, code: str) -> None:
        self._done.add(number)
        line = self._source.lines[number]
        is_light = line.type == "traffic_light"
        match = _CODE.fullmatch(code.lower())
        if not is_light and match is None:
            self.lost[f"signs without a number of a catalogue (subtype {code or '(none)'})"] += 1
            return
        middle = 0.5 * (line.points[0] + line.points[-1])
        found = self._nearest(middle[:2], user)
        if found is None:
            self.lost[f"signals and signs farther than {_REACH:g} m from roads"] += 1
            return
        n, s, t = found
        road = self._roads[n]
        heading = float(road.shape.curve.at(np.array([s]))[1][0])
        traffic = self._heading(user)
        if traffic is None:
            left_hand = road.element.get("rule") == "LHT"
            traffic = heading if (t < 0.0) != left_hand else heading + np.pi
        turn = (traffic - heading + np.pi) % (2.0 * np.pi) - np.pi
        along = abs(turn) <= np.pi / 2
        kind = _LIGHT if is_light else match.group(2)  # type: ignore[union-attr]
        signals = holder(road.element, "signals")
        name = f"signal_{line.id}"
        country = "DE" if match is None else match.group(1).upper()
        elements.add_signal(signals, name, kind, s, t, "+" if along else "-", country=country)
        offset = turn if along else (turn - np.sign(turn) * np.pi)
        if abs(offset) > _TURN:
            signals[-1].set("hOffset", elements.text(offset))
        if match is not None and match.group(3):
            signals[-1].set("subtype", match.group(3))
        height = float(line.points[:, 2].min()) - _height_at(road, s)
        if _HEIGHTS[0] < height < _HEIGHTS[1]:
            signals[-1].set("zOffset", elements.text(round(height, 3)))
        self.counts["traffic lights" if is_light else "signs"] += 1

    def _heading(self, user: int | None) -> float | None:
        """Direction of a lanelet's traffic at its end, radians."""
        if user is None:
            return None
        points = border_points(self._source, self._source.lanelets[user].left)
        step = points[-1, :2] - points[-2, :2]
        return float(np.arctan2(step[1], step[0]))

    def _add_stop_line(self, number: int, user: int | None) -> None:
        self._done.add(number)
        line = self._source.lines[number]
        ends = line.points[[0, -1], :2]
        length = float(np.hypot(*(ends[1] - ends[0])))
        found = self._nearest(ends.mean(0), user)
        if found is None or not _LINES[0] <= length <= _LINES[1]:
            low, high = _LINES
            self.lost[f"stop lines beyond {low:g} to {high:g} m, or far from roads"] += 1
            return
        across = (ends[1] - ends[0]) / length
        ring = _rectangle(ends.mean(0), np.array([across[1], -across[0]]), _HALF, length / 2.0)
        self._add_outline(found, line, ("roadMark", "stop line"), ring, across)
        self.counts["stop lines"] += 1

    def _add_crossing(self, number: int) -> None:
        lanelet = self._source.lanelets[number]
        left, right = (
            border_points(self._source, side)[:, :2] for side in (lanelet.left, lanelet.right)
        )
        shape = shapely.buffer(shapely.polygons(np.concatenate([left, right[::-1]])), 0.0)
        near = self._tree.query(shape, predicate="intersects")
        parts = shapely.intersection(self._areas[near], shape)
        paved = shapely.union_all(shapely.buffer(parts, 0.01))
        pieces = shapely.get_parts(paved)
        pieces = [p for p in pieces if p.geom_type == "Polygon" and p.area > _LEAST_CROSSING]
        if not pieces:
            self.lost["crosswalks beside all roads"] += 1
            return
        walk = 0.5 * (left[-1] + right[-1]) - 0.5 * (left[0] + right[0])
        walk /= max(float(np.hypot(*walk)), 1e-9)
        for n, piece in enumerate(pieces):
            road = int(near[np.argmax(shapely.area(shapely.intersection(parts, piece)))])
            middle = shapely.get_coordinates(piece.centroid)[0]
            curve = self._roads[road].shape.curve
            s, t = (float(each[0]) for each in curve.located(middle[None]))
            s = float(np.clip(s, 0.0, curve.length))
            ring = shapely.get_coordinates(shapely.simplify(piece, 0.05).exterior)[:-1]
            line = self._source.lines[lanelet.left.line]
            kind = ("crosswalk", f"crosswalk {lanelet.id}_{n}")
            self._add_outline((road, s, t), line, kind, ring, walk)
            self.counts["crosswalks"] += 1

    def _add_outline(
        self,
        place: tuple[int, float, float],
        line: LaneletLine,
        kind: tuple[str, str],
        ring: FloatArray,
        across: FloatArray,
    ) -> None:
        """An object with an outline; u of its corners runs square to `across`."""
        n, s, t = place
        road = self._roads[n]
        here, heading = road.shape.curve.at(np.array([s]))
        origin = here[0] + t * np.array([-np.sin(heading[0]), np.cos(heading[0])])
        turn = float(np.arctan2(-across[0], across[1])) - float(heading[0])
        turn = (turn + np.pi / 2) % np.pi - np.pi / 2
        first = np.array([np.cos(heading[0] + turn), np.sin(heading[0] + turn)])
        u, v = (ring - origin) @ first, (ring - origin) @ np.array([-first[1], first[0]])
        objects = holder(road.element, "objects")
        item = etree.SubElement(
            objects, "object", id=f"{kind[0]}_{line.id}_{len(objects)}", type=kind[0],
            name=kind[1], s=elements.text(s), t=elements.text(t), zOffset="0",
            hdg=elements.text(turn), orientation="none",
        )  # fmt: skip
        outlines = etree.SubElement(item, "outlines")
        outline = etree.SubElement(outlines, "outline", id="0", closed="true")
        for a, b in zip(u.tolist(), v.tolist(), strict=True):
            corner = {"u": elements.text(a), "v": elements.text(b), "z": "0", "height": "0"}
            etree.SubElement(outline, "cornerLocal", corner)


def _area(road: LaneletRoad) -> shapely.Geometry:
    """Area of a road in plan."""
    shape = road.shape
    s = np.linspace(0.0, shape.curve.length, max(int(shape.curve.length), 2) + 1)
    places, heading = shape.curve.at(s)
    normal = np.column_stack([-np.sin(heading), np.cos(heading)])
    t = shape.at(s)
    left, right = (places + t[:, [k]] * normal for k in (0, -1))
    return shapely.buffer(shapely.polygons(np.concatenate([left, right[::-1]])), 0.0)


def _rectangle(middle: FloatArray, ahead: FloatArray, half: float, across: float) -> FloatArray:
    side = np.array([-ahead[1], ahead[0]])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    ring: FloatArray = middle + signs[:, [0]] * half * ahead + signs[:, [1]] * across * side
    return ring


def _height_at(road: LaneletRoad, s: float) -> float:
    pieces = road.shape.elevation
    piece = next((p for p in reversed(pieces) if p[0] <= s + 1e-9), pieces[0])
    d = s - piece[0]
    return piece[1] + d * (piece[2] + d * (piece[3] + d * piece[4]))
