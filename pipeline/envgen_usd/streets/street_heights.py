"""Heights of mapped streets: those of the ground, smooth, apart where bridges cross."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import spsolve

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.street_plan import StreetPlan, StreetProfile
from envgen_usd.streets.junction_clusters import JunctionPlan, carriageway_half
from envgen_usd.streets.street_ties import HeightTie, crossings_of, levels_along, side_by_side

Ground = Callable[[FloatArray], FloatArray]
"""Heights at points, N x 2, metres."""
_STEP = 12.0
"""Distance of the points where heights are solved for, metres."""
_STIFF = 30.0
"""Weight of a change of slope; a larger value makes streets smoother and farther from the land."""
STEEPEST = 0.135
"""Largest slope that is aimed at, also at the inner edge of a bend."""
_LEVEL = 200.0
"""Weight of differences of height within a junction; a larger value makes junctions level."""
_TIGHTEST = 0.5
"""Least length of the inner edge of a bend that counts, as a share of the line's."""
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
    plan: StreetPlan,
    curves: Sequence[RoundedLine],
    junctions: JunctionPlan,
    ground: Ground | None,
) -> StreetHeights:
    """Solves for the heights of all streets at once.

    The least squares of the distance from the ground, of changes of slope, of differences of
    height within junctions, and of the distance of streets that cross from their clearance. Streets
    share the height of their nodes. Steps that are steeper than `STEEPEST` anywhere are made
    flatter with a growing weight.

    Args:
        plan: The streets.
        curves: Their lines.
        junctions: Where the streets end as roads.
        ground: Heights of the land; `None` for level land.
    """
    along, numbers = _points(plan, curves)
    total = int(max(n.max() for n in numbers)) + 1
    places = np.zeros((total, 2))
    for curve, s, number in zip(curves, along, numbers, strict=True):
        places[number] = curve(s)[0]
    land = np.zeros(total) if ground is None else ground(places)
    ties = crossings_of(plan, curves, along, numbers)
    lines = _Lines(along, numbers, _level_ends(along, junctions), _inner_edges(plan, curves, along))
    heights = land
    if ground is not None or ties:
        ties += side_by_side(plan, curves, junctions, along, numbers)
        heights = _solved(land, lines, ties, _tied(plan, along, numbers, total))
    own = tuple(heights[number] for number in numbers)
    return StreetHeights(tuple(along), own, lines.slopes(heights))


@dataclass(frozen=True, eq=False)
class _Lines:
    """The points of all streets.

    Attributes:
        along: Distances of each street's points, metres.
        numbers: Their numbers.
        level: Number of steps at each street's begin and end that belong to junctions.
        inner: Length of the inner edge of each step as a share of the step.
    """

    along: Sequence[FloatArray]
    numbers: Sequence[IntArray]
    level: Sequence[tuple[int, int]]
    inner: Sequence[FloatArray]

    def slopes(self, heights: FloatArray) -> tuple[FloatArray, ...]:
        """Derivatives at the points of each street; a junction keeps its own up to its border."""
        found = []
        for s, number, (first, last) in zip(self.along, self.numbers, self.level, strict=True):
            height = heights[number]
            slope, chord = np.gradient(height, s), np.diff(height) / np.diff(s)
            if first:
                slope[first] = chord[first - 1]
            if last:
                slope[-1 - last] = chord[-last]
            found.append(slope)
        return tuple(found)

    def steepest(self, heights: FloatArray) -> FloatArray:
        """Largest slope of each step at the inner edge of the carriageway."""
        found = []
        for s, number, inner, slope in zip(
            self.along, self.numbers, self.inner, self.slopes(heights), strict=True
        ):
            chord, out, into = np.diff(heights[number]) / np.diff(s), slope[:-1], slope[1:]
            # The derivative of a Hermite cubic is a parabola.
            square, cube = 3 * chord - 2 * out - into, out + into - 2 * chord
            flat = np.abs(cube) < 1e-9
            top = np.clip(-square / (3 * np.where(flat, 1.0, cube)), 0.0, 1.0)
            middle = np.where(flat, 0.0, out + top * (2 * square + 3 * cube * top))
            found.append(np.abs([out, into, middle]).max(0) / inner)
        return np.concatenate(found)


def _level_ends(along: Sequence[FloatArray], junctions: JunctionPlan) -> list[tuple[int, int]]:
    """Number of steps at the begin and at the end of each street that belong to junctions."""
    found = [[0, 0] for _ in along]
    for cluster in junctions.clusters:
        if len(cluster.arms) + len(cluster.inner) < 3:
            continue
        for arm in cluster.arms:
            cut, s = junctions.cuts[arm.street], along[arm.street]
            if cut is not None:
                reach = cut[0] if arm.at_start else s[-1] - cut[1]
                steps = int(np.ceil(reach / s[1] - 1e-6))
                found[arm.street][not arm.at_start] = min(max(steps, 1), (len(s) - 1) // 2)
        for street in (*cluster.inner, *cluster.ring):
            found[street] = [len(along[street]) - 1, 0]
    return [(first, last) for first, last in found]


def _inner_edges(
    plan: StreetPlan, curves: Sequence[RoundedLine], along: Sequence[FloatArray]
) -> list[FloatArray]:
    """Length of the inner edge of the carriageway at each step as a share of the step."""
    found = []
    for street, curve, s in zip(plan.streets, curves, along, strict=True):
        half = max(carriageway_half(each) + _parking(each) for each in street.profiles)
        shares = np.ones(len(s) - 1)
        step = np.clip(np.searchsorted(s, curve.s, "right") - 1, 0, len(shares) - 1)
        last = np.append(curve.s[1:], curve.length)
        until = np.clip(np.searchsorted(s, last, "left") - 1, 0, len(shares) - 1)
        inner = np.maximum(1.0 - np.abs(curve.curvature) * half, _TIGHTEST)
        for share, first, end in zip(inner.tolist(), step.tolist(), until.tolist(), strict=True):
            shares[first : end + 1] = np.minimum(shares[first : end + 1], share)
        found.append(shares)
    return found


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
        raised = levels_along(street, s) != 0
        weight[number[raised]] = 0.0
    weight[: len(plan.nodes)] = np.maximum(weight[: len(plan.nodes)], 0.02)
    return weight


def _parking(profile: StreetProfile) -> float:
    """Width of the wider parking lane of a street, metres; 0 without one."""
    return max(
        (lane.width for lane in (*profile.left, *profile.right) if lane.kind == "parking"),
        default=0.0,
    )


def _solved(
    land: FloatArray,
    lines: _Lines,
    ties: Sequence[HeightTie],
    tied: FloatArray,
) -> FloatArray:
    total = len(land)
    rows = _Rows(total)
    rows.add(np.arange(total)[:, None], np.ones((total, 1)), land, tied)
    for s, number in zip(lines.along, lines.numbers, strict=True):
        before, after = np.diff(s)[:-1], np.diff(s)[1:]
        bend = np.stack([1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after], axis=1)
        points = np.stack([number[:-2], number[1:-1], number[2:]], axis=1)
        rows.add(points, bend, np.zeros(len(bend)), np.full(len(bend), _STIFF))
    beside = _within_junctions(lines)
    rows.add(
        beside, np.tile([1.0, -1.0], (len(beside), 1)), np.zeros(len(beside)),
        np.full(len(beside), _LEVEL),
    )  # fmt: skip
    for tie in ties:
        (a, b, share), (c, d, other) = tie.upper, tie.lower
        rows.add(
            np.array([[a, b, c, d]]),
            np.array([[1.0 - share, share, other - 1.0, -other]]),
            np.array([tie.distance]),
            np.array([_CROSSING]),
        )
    pairs = np.concatenate([np.stack([n[:-1], n[1:]], axis=1) for n in lines.numbers])
    spans = np.concatenate([np.diff(s) for s in lines.along])
    heights, weight = rows.solve(), np.zeros(len(pairs))
    for _ in range(_ROUNDS):
        slope = (heights[pairs[:, 1]] - heights[pairs[:, 0]]) / spans
        flatter = STEEPEST / np.maximum(lines.steepest(heights), 1e-9)
        if not (flatter < 1.0).any():
            break
        weight[flatter < 1.0] = np.maximum(weight[flatter < 1.0] * 3.0, 30.0)
        chosen = weight > 0.0
        size = 1.0 / spans[chosen]
        goal = slope[chosen] * np.minimum(0.95 * flatter[chosen], 1.0)
        extra = rows.with_rows(pairs[chosen], np.stack([-size, size], axis=1), goal, weight[chosen])
        heights = extra.solve()
    return heights


def _within_junctions(lines: _Lines) -> IntArray:
    """Pairs of points that follow each other within junctions, N x 2."""
    found = [np.zeros((0, 2), np.int64)]
    for number, (first, last) in zip(lines.numbers, lines.level, strict=True):
        steps = np.stack([number[:-1], number[1:]], axis=1)
        found += [steps[:first], steps[len(steps) - last :]]
    pairs: IntArray = np.concatenate(found)
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
