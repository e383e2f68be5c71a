"""Which nodes of a map are one junction, and where streets end before it."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.street_plan import CARRIAGEWAY, StreetPlan, StreetProfile
from envgen_usd.streets.street_sections import line_offset

_HORIZON = 60.0
"""Length of a street in which its junction ends, metres."""
_STEP = 0.5
"""Distance of the places that are tried, metres; a smaller value makes junctions tighter."""
_CORNER = 5.0
"""Distance between the kerbs of two streets at a corner, metres; a larger value rounds it more."""
_BESIDE = 0.5
"""Distance between two streets that part at a small angle, metres."""
_LEAST_TRIM = 3.0
"""Least distance from a junction's node to the end of a street, metres."""
_LEAST_STREET = 6.0
"""Least length of a street between junctions, metres; nodes nearer to one another are merged."""
_LONGEST_INNER = 45.0
"""Length of the longest street that becomes a part of a junction, metres."""
_LARGEST_RING = 200.0
"""Length of the longest roundabout that is a single junction, metres."""
_PARALLEL, _OPPOSITE = np.radians(28.0), np.radians(150.0)


@dataclass(frozen=True)
class ArmEnd:
    """An end of a street at a junction.

    Attributes:
        street: Number of the street.
        at_start: The street begins there.
    """

    street: int
    at_start: bool


@dataclass(frozen=True, eq=False)
class Cluster:
    """Nodes that are one junction, or a single end of a street.

    Attributes:
        nodes: Numbers of the nodes.
        arms: Ends of the streets that lead away.
        inner: Numbers of the streets within.
        ring: Numbers of the streets of its roundabout, if it is one.
    """

    nodes: tuple[int, ...]
    arms: tuple[ArmEnd, ...]
    inner: tuple[int, ...]
    ring: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class JunctionPlan:
    """Junctions, and what is left of the streets between them.

    Attributes:
        clusters: The junctions, and the ends of streets without one.
        cuts: Distances along each street between which it is a road; `None` within a junction, or
            where it is too short.
        short: Numbers of streets that are too short for a road.
    """

    clusters: tuple[Cluster, ...]
    cuts: tuple[tuple[float, float] | None, ...]
    short: tuple[int, ...]


def carriageway_half(profile: StreetProfile) -> float:
    """Distance of the farther kerb from the line at a junction, metres."""
    half, offset = (
        float(
            sum(
                sign * lane.width
                for side, sign in (("left", signs[0]), ("right", signs[1]))
                for lane in getattr(profile, side)
                if lane.kind in CARRIAGEWAY and not lane.raised
            )
        )
        / 2.0
        for signs in ((1.0, 1.0), (-1.0, 1.0))
    )
    return half + abs(line_offset(profile) - offset)


def plan_junctions(plan: StreetPlan, curves: Sequence[RoundedLine]) -> JunctionPlan:
    """Finds junctions.

    1. The nodes of a small roundabout are one junction.
    2. Each street ends where it is clear of the others of its junction.
    3. Nodes between which no street is left are one junction; repeated until none is left.

    Args:
        plan: The streets.
        curves: Their lines.
    """
    search = _Search(plan, curves)
    while search.merge_nearest():
        pass
    return search.result()


class _Search:
    """Union of nodes by what is left of the streets between them."""

    def __init__(self, plan: StreetPlan, curves: Sequence[RoundedLine]) -> None:
        self._plan, self._curves = plan, curves
        self._parent = list(range(len(plan.nodes)))
        self._known: dict[tuple[tuple[ArmEnd, ...], tuple[int, ...]], FloatArray] = {}
        self._shapes = _ArmShapes(plan, curves)
        self._unite_rings()

    def _unite_rings(self) -> None:
        rings: dict[int, list[int]] = defaultdict(list)
        trial = list(range(len(self._plan.nodes)))
        for street in self._plan.streets:
            if street.ring:
                _unite(trial, street.start, street.end)
        for number, street in enumerate(self._plan.streets):
            if street.ring:
                rings[_root(trial, street.start)].append(number)
        for streets in rings.values():
            if sum(self._curves[n].length for n in streets) < _LARGEST_RING:
                for n in streets:
                    _unite(self._parent, self._plan.streets[n].start, self._plan.streets[n].end)

    def _clusters(self) -> list[Cluster]:
        nodes: dict[int, list[int]] = defaultdict(list)
        arms: dict[int, list[ArmEnd]] = defaultdict(list)
        inner: dict[int, list[int]] = defaultdict(list)
        for node in range(len(self._plan.nodes)):
            nodes[_root(self._parent, node)].append(node)
        for number, street in enumerate(self._plan.streets):
            start, end = (_root(self._parent, node) for node in (street.start, street.end))
            if start == end and (street.ring or self._curves[number].length < _LONGEST_INNER):
                inner[start].append(number)
            else:
                arms[start].append(ArmEnd(number, True))
                arms[end].append(ArmEnd(number, False))
        return [
            Cluster(
                tuple(own),
                tuple(arms[root]),
                tuple(inner[root]),
                tuple(n for n in inner[root] if self._plan.streets[n].ring),
            )
            for root, own in nodes.items()
        ]

    def _trims(self, clusters: Sequence[Cluster]) -> FloatArray:
        """Length that each street loses at its start and end, S x 2."""
        cuts = np.zeros((len(self._plan.streets), 2))
        for cluster in clusters:
            key = cluster.arms, cluster.inner
            if key not in self._known:
                self._known[key] = self._shapes.trims(cluster)
            for arm, trim in zip(cluster.arms, self._known[key], strict=True):
                cuts[arm.street, 0 if arm.at_start else 1] = trim
        return cuts

    def merge_nearest(self) -> bool:
        """Merges the ends of short streets; False if there is none."""
        clusters = self._clusters()
        is_inner = {n for cluster in clusters for n in cluster.inner}
        junctions = {node: len(c.arms) + len(c.inner) > 1 for c in clusters for node in c.nodes}
        left = self._lengths() - self._trims(clusters).sum(1)
        merged = False
        for number in np.argsort(left).tolist():
            if left[number] >= _LEAST_STREET:
                break
            street = self._plan.streets[number]
            near = self._curves[number].length < _LONGEST_INNER
            if number in is_inner or not near:
                continue
            if junctions[street.start] and junctions[street.end]:
                merged |= _unite(self._parent, street.start, street.end)
        return merged

    def _lengths(self) -> FloatArray:
        return np.array([curve.length for curve in self._curves])

    def result(self) -> JunctionPlan:
        """The junctions, with streets of at least half of their length where junctions are near."""
        clusters = self._clusters()
        trims, lengths = self._trims(clusters), self._lengths()
        is_inner = {n for cluster in clusters for n in cluster.inner}
        cuts: list[tuple[float, float] | None] = []
        short = []
        for number, (trim, length) in enumerate(zip(trims, lengths.tolist(), strict=True)):
            if number in is_inner:
                cuts.append(None)
                continue
            room = max(length - _LEAST_STREET, 0.4 * length)
            first, last = (trim * min(1.0, room / max(trim.sum(), 1e-9))).tolist()
            if length - first - last < 2.0:
                short.append(number)
                cuts.append(None)
            else:
                cuts.append((first, length - last))
        gone = set(short)
        clusters = [
            Cluster(c.nodes, tuple(a for a in c.arms if a.street not in gone), c.inner, c.ring)
            for c in clusters
        ]
        return JunctionPlan(tuple(clusters), tuple(cuts), tuple(short))


class _ArmShapes:
    """Streets near their ends, in plan."""

    def __init__(self, plan: StreetPlan, curves: Sequence[RoundedLine]) -> None:
        self._plan, self._curves = plan, curves
        self._half = [
            (carriageway_half(s.profiles[0]), carriageway_half(s.profiles[-1]))
            for s in plan.streets
        ]
        self._known: dict[ArmEnd, tuple[FloatArray, FloatArray]] = {}

    def _of(self, arm: ArmEnd) -> tuple[FloatArray, FloatArray]:
        """Points and unit normals from the node outwards."""
        if arm not in self._known:
            curve = self._curves[arm.street]
            ahead = np.arange(0.0, min(curve.length, _HORIZON) + 1e-6, _STEP)
            if len(ahead) < 2:
                ahead = np.array([0.0, curve.length])
            points, heading = curve(ahead if arm.at_start else curve.length - ahead)
            heading = heading + (0.0 if arm.at_start else np.pi)
            self._known[arm] = points, np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        return self._known[arm]

    def _half_of(self, arm: ArmEnd) -> float:
        return self._half[arm.street][0 if arm.at_start else 1]

    def _node(self, arm: ArmEnd) -> int:
        street = self._plan.streets[arm.street]
        return street.start if arm.at_start else street.end

    def trims(self, cluster: Cluster) -> FloatArray:
        """Length from its node at which each arm is clear of the others, metres."""
        if len(cluster.arms) + len(cluster.inner) < 2:
            return np.zeros(len(cluster.arms))
        strips = [self._strip(arm) for arm in cluster.arms]
        inner = [self._inner_strip(number) for number in cluster.inner]
        found = [
            max(
                _LEAST_TRIM,
                *(
                    self._clear(arm, strips[n], *self._room(arm, other))
                    for n, other in enumerate(cluster.arms)
                    if other != arm
                ),
                *(self._clear(arm, strip, _CORNER / 2.0, True) for strip in inner),
            )
            for arm in cluster.arms
        ]
        return np.array(found)

    def _room(self, arm: ArmEnd, other: ArmEnd) -> tuple[float, bool]:
        """Distance that two arms keep, and whether they are held against each other."""
        angle = abs(self._turn(arm, other))
        same = self._node(arm) == self._node(other)
        if angle < _PARALLEL:
            return _BESIDE, same
        if angle > _OPPOSITE:
            return 0.0, False
        return _CORNER, True

    def _turn(self, arm: ArmEnd, other: ArmEnd) -> float:
        ways = []
        for each in (arm, other):
            points, _ = self._of(each)
            step = points[min(len(points) - 1, int(10.0 / _STEP))] - points[0]
            ways.append(np.arctan2(step[1], step[0]))
        return float((ways[1] - ways[0] + np.pi) % (2.0 * np.pi) - np.pi)

    def _strip(self, arm: ArmEnd) -> shapely.Geometry:
        return _strip(self._of(arm)[0], self._half_of(arm))

    def _inner_strip(self, number: int) -> shapely.Geometry:
        curve = self._curves[number]
        points, _ = curve(np.linspace(0.0, curve.length, max(int(curve.length), 2)))
        return _strip(points, max(self._half[number]))

    def _clear(self, arm: ArmEnd, strip: shapely.Geometry, room: float, held: bool) -> float:
        """Distance from the node beyond which the street keeps the room, metres."""
        if not held:
            return 0.0
        points, normals = self._of(arm)
        side = self._half_of(arm) * normals
        across = shapely.linestrings(np.stack([points - side, points + side], axis=1))
        near = np.flatnonzero(shapely.distance(across, strip) < room)
        return float((near[-1] + 1) * _STEP) if len(near) else 0.0


def _strip(points: FloatArray, half: float) -> shapely.Geometry:
    return shapely.buffer(shapely.LineString(points), max(half, 0.5), cap_style="flat")


def _root(parent: list[int], node: int) -> int:
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


def _unite(parent: list[int], first: int, second: int) -> bool:
    """Joins two sets; False if they are one."""
    roots = sorted((_root(parent, first), _root(parent, second)))
    parent[roots[1]] = roots[0]
    return roots[0] != roots[1]
