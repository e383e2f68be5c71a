"""Heights of mapped streets: those of the ground, smooth, apart where bridges cross."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import spsolve

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.street_plan import MappedStreet, StreetPlan

Ground = Callable[[FloatArray], FloatArray]
"""Heights at points, N x 2, metres."""
_STEP = 12.0
"""Distance of the points where heights are solved for, metres."""
_STIFF = 30.0
"""Weight of a change of slope; a larger value makes streets smoother and farther from the land."""
CLEARANCE = 5.7
"""Height of a street above the one below it, metres."""
STEEPEST = 0.12
"""Largest slope that is aimed at."""
_LEVEL = 40.0
"""Weight of the difference of height beside a junction; a larger value makes junctions level."""
_CROSSING = 1000.0
"""Weight of the distance of two streets that cross; a larger value keeps it more exactly."""
_ROUNDS = 40
"""Rounds in which too steep steps are made flatter."""


@dataclass(frozen=True, eq=False)
class StreetHeights:
    """Heights along streets.

    Attributes:
        along: Distances of each street's points, metres.
        heights: Height of each, metres.
        slopes: Derivative at each.
    """

    along: tuple[FloatArray, ...]
    heights: tuple[FloatArray, ...]
    slopes: tuple[FloatArray, ...]

    def at(self, street: int, s: float) -> tuple[float, float]:
        """Height and slope of a street at a distance along it."""
        along, height = self.along[street], self.heights[street]
        n = int(np.clip(np.searchsorted(along, s, "right") - 1, 0, len(along) - 2))
        span = along[n + 1] - along[n]
        share = (s - along[n]) / span
        a, b = height[n : n + 2]
        out, into = span * self.slopes[street][n : n + 2]
        square, cube = 3 * (b - a) - 2 * out - into, out + into - 2 * (b - a)
        value = a + share * (out + share * (square + share * cube))
        return float(value), float((out + share * (2 * square + 3 * cube * share)) / span)

    def pieces(
        self, street: int, first: float, last: float
    ) -> list[tuple[float, float, float, float, float]]:
        """Cubics of the elevation between two distances, for s from the first."""
        along = self.along[street]
        inner = along[(along > first + 1.0) & (along < last - 1.0)].tolist()
        at = [first, *inner, last]
        values = [self.at(street, s) for s in at]
        found = []
        for n in range(len(at) - 1):
            (a, out), (b, into), span = values[n], values[n + 1], at[n + 1] - at[n]
            square = (3 * (b - a) / span - 2 * out - into) / span
            cube = (out + into - 2 * (b - a) / span) / span**2
            found.append((at[n] - first, a, out, square, cube))
        return found


def street_heights(
    plan: StreetPlan, curves: Sequence[RoundedLine], ground: Ground | None
) -> StreetHeights:
    """Solves for the heights of all streets at once.

    The least squares of the distance from the ground, of changes of slope, of slopes beside
    junctions, and of the distance of streets that cross from their clearance. Streets share the
    height of their nodes. Steps steeper than `STEEPEST` are drawn to it with a growing weight.

    Args:
        plan: The streets.
        curves: Their lines.
        ground: Heights of the land; `None` for level land.
    """
    along, numbers = _points(plan, curves)
    total = int(max(n.max() for n in numbers)) + 1
    places = np.zeros((total, 2))
    for curve, s, number in zip(curves, along, numbers, strict=True):
        places[number] = curve(s)[0]
    land = np.zeros(total) if ground is None else ground(places)
    crossings = _crossings(plan, curves, along, numbers)
    heights = land
    if ground is not None or crossings:
        heights = _solved(land, along, numbers, crossings, _tied(plan, along, numbers, total))
    own = tuple(heights[number] for number in numbers)
    slopes = tuple(np.gradient(h, s) for h, s in zip(own, along, strict=True))
    return StreetHeights(tuple(along), own, slopes)


def _points(
    plan: StreetPlan, curves: Sequence[RoundedLine]
) -> tuple[list[FloatArray], list[IntArray]]:
    """Distances of the points of each street, and their numbers; nodes come first."""
    last = len(plan.nodes)
    along, numbers = [], []
    for street, curve in zip(plan.streets, curves, strict=True):
        count = max(int(np.ceil(curve.length / _STEP)), 2)
        along.append(np.linspace(0.0, curve.length, count + 1))
        inner = last + np.arange(count - 1)
        last += count - 1
        numbers.append(np.concatenate([[street.start], inner, [street.end]]))
    return along, numbers


def _tied(
    plan: StreetPlan, along: Sequence[FloatArray], numbers: Sequence[IntArray], total: int
) -> FloatArray:
    """Weight of the land at each point: none on bridges and in tunnels."""
    weight = np.ones(total)
    for street, s, number in zip(plan.streets, along, numbers, strict=True):
        raised = _levels(street, s) != 0
        weight[number[raised]] = 0.0
    weight[: len(plan.nodes)] = np.maximum(weight[: len(plan.nodes)], 0.02)
    return weight


def _levels(street: MappedStreet, along: FloatArray) -> IntArray:
    """Layer of the map at distances along a street."""
    steps = np.linalg.norm(np.diff(street.line, axis=0), axis=1)
    ends = np.append(0.0, np.cumsum(steps)) * along[-1] / steps.sum()
    firsts = ends[list(street.breaks)]
    stretch = np.clip(np.searchsorted(firsts, along, "right") - 1, 0, len(firsts) - 1)
    levels: IntArray = np.array([p.level for p in street.profiles])[stretch]
    return levels


@dataclass(frozen=True)
class _Crossing:
    """Two streets one above the other, each between two points with shares."""

    upper: tuple[int, int, float]
    lower: tuple[int, int, float]
    distance: float


def _crossings(
    plan: StreetPlan,
    curves: Sequence[RoundedLine],
    along: Sequence[FloatArray],
    numbers: Sequence[IntArray],
) -> list[_Crossing]:
    """Places where streets of different layers cross in plan."""
    fine = [
        curve(np.linspace(0.0, curve.length, max(int(curve.length / 2), 2)))[0] for curve in curves
    ]
    lines = [shapely.LineString(points) for points in fine]
    raised = [n for n, street in enumerate(plan.streets) if any(p.level for p in street.profiles)]
    tree = shapely.STRtree(lines)
    found = []
    for number in raised:
        for other in tree.query(lines[number], predicate="crosses").tolist():
            if other in raised and other <= number:
                continue
            meet = shapely.intersection(lines[number], lines[other])
            for point in shapely.get_parts(meet):
                if point.geom_type != "Point":
                    continue
                places = []
                for n in (number, other):
                    s = shapely.line_locate_point(lines[n], point) * (
                        curves[n].length / lines[n].length
                    )
                    level = int(_levels(plan.streets[n], np.array([s, curves[n].length]))[0])
                    k = int(np.clip(np.searchsorted(along[n], s) - 1, 0, len(along[n]) - 2))
                    share = (s - along[n][k]) / (along[n][k + 1] - along[n][k])
                    places.append(
                        (level, (int(numbers[n][k]), int(numbers[n][k + 1]), float(share)))
                    )
                (first, one), (second, two) = places
                if first != second:
                    upper, lower = (one, two) if first > second else (two, one)
                    found.append(_Crossing(upper, lower, CLEARANCE))
    return found


def _solved(
    land: FloatArray,
    along: Sequence[FloatArray],
    numbers: Sequence[IntArray],
    crossings: Sequence[_Crossing],
    tied: FloatArray,
) -> FloatArray:
    total = len(land)
    rows = _Rows(total)
    rows.add(np.arange(total)[:, None], np.ones((total, 1)), land, tied)
    for s, number in zip(along, numbers, strict=True):
        before, after = np.diff(s)[:-1], np.diff(s)[1:]
        bend = np.stack([1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after], axis=1)
        points = np.stack([number[:-2], number[1:-1], number[2:]], axis=1)
        rows.add(points, bend, np.zeros(len(bend)), np.full(len(bend), _STIFF))
    beside = _beside_junctions(numbers)
    rows.add(
        beside, np.tile([1.0, -1.0], (len(beside), 1)), np.zeros(len(beside)),
        np.full(len(beside), _LEVEL),
    )  # fmt: skip
    for cross in crossings:
        (a, b, share), (c, d, other) = cross.upper, cross.lower
        rows.add(
            np.array([[a, b, c, d]]),
            np.array([[1.0 - share, share, other - 1.0, -other]]),
            np.array([cross.distance]),
            np.array([_CROSSING]),
        )
    pairs = np.concatenate([np.stack([n[:-1], n[1:]], axis=1) for n in numbers])
    spans = np.concatenate([np.diff(s) for s in along])
    heights, weight = rows.solve(), np.zeros(len(pairs))
    for _ in range(_ROUNDS):
        slope = (heights[pairs[:, 1]] - heights[pairs[:, 0]]) / spans
        steep = np.abs(slope) > STEEPEST
        if not steep.any():
            break
        weight[steep] = np.maximum(weight[steep] * 3.0, 30.0)
        chosen = weight > 0.0
        size = 1.0 / spans[chosen]
        goal = np.clip(slope[chosen], -0.9 * STEEPEST, 0.9 * STEEPEST)
        extra = rows.with_rows(pairs[chosen], np.stack([-size, size], axis=1), goal, weight[chosen])
        heights = extra.solve()
    return heights


def _beside_junctions(numbers: Sequence[IntArray]) -> IntArray:
    """Pairs of a node where three streets meet or more, and the next point of each, N x 2."""
    ends = np.concatenate([np.stack([n[[0, 1]], n[[-1, -2]]]) for n in numbers])
    count = np.bincount(ends[:, 0])
    pairs: IntArray = ends[count[ends[:, 0]] > 2]
    return pairs


class _Rows:
    """Weighted equations of a least-squares problem."""

    def __init__(self, total: int) -> None:
        self._total = total
        self._matrix: csr_array = csr_array((total, total))
        self._side = np.zeros(total)

    def add(
        self, points: IntArray, factors: FloatArray, goal: FloatArray, weight: FloatArray
    ) -> None:
        """Adds equations; points and factors are N x K."""
        count, width = points.shape
        rows = np.repeat(np.arange(count), width)
        part = coo_array((factors.ravel(), (rows, points.ravel())), (count, self._total)).tocsr()
        scaled = part.T @ (part * weight[:, None])
        self._matrix = csr_array(self._matrix + scaled)
        self._side = self._side + part.T @ (weight * goal)

    def with_rows(
        self, points: IntArray, factors: FloatArray, goal: FloatArray, weight: FloatArray
    ) -> "_Rows":
        """A problem with more equations."""
        more = _Rows(self._total)
        more._matrix, more._side = self._matrix, self._side
        more.add(points, factors, goal, weight)
        return more

    def solve(self) -> FloatArray:
        """The unknowns."""
        solution: FloatArray = spsolve(self._matrix.tocsc(), self._side)
        return solution
