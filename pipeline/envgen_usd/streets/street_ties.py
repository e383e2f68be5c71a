"""Places where heights of mapped streets depend on each other: bridges, and side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from envgen_usd.geometry.rounded_lines import RoundedLine
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.street_plan import MappedStreet, StreetPlan
from envgen_usd.streets.junction_clusters import JunctionPlan, carriageway_half

CLEARANCE = 5.7
"""Height of a street above the one below it, metres."""
_BESIDE = 2.0
"""Distance of carriageways up to which streets that end side by side have one height, metres."""


@dataclass(frozen=True)
class HeightTie:
    """Two streets one above the other, or side by side.

    Attributes:
        upper: Numbers of two points of the upper street, and the share of the second.
        lower: The same of the lower street.
        distance: Height of the upper above the lower street, metres.
    """

    upper: tuple[int, int, float]
    lower: tuple[int, int, float]
    distance: float


def crossings_of(
    plan: StreetPlan,
    curves: Sequence[RoundedLine],
    along: Sequence[FloatArray],
    numbers: Sequence[IntArray],
) -> list[HeightTie]:
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
                    level = int(levels_along(plan.streets[n], np.array([s, curves[n].length]))[0])
                    places.append((level, _between(along[n], numbers[n], s)))
                (first, one), (second, two) = places
                if first != second:
                    upper, lower = (one, two) if first > second else (two, one)
                    found.append(HeightTie(upper, lower, CLEARANCE))
    return found


def _between(along: FloatArray, numbers: IntArray, s: float) -> tuple[int, int, float]:
    """The points of a street before and after a distance along it, and the share between them."""
    k = int(np.clip(np.searchsorted(along, s) - 1, 0, len(along) - 2))
    share = (s - along[k]) / (along[k + 1] - along[k])
    return int(numbers[k]), int(numbers[k + 1]), float(share)


def side_by_side(
    plan: StreetPlan,
    curves: Sequence[RoundedLine],
    junctions: JunctionPlan,
    along: Sequence[FloatArray],
    numbers: Sequence[IntArray],
) -> list[HeightTie]:
    """Ends of streets whose carriageways lie side by side at a junction, at one height."""
    found = []
    for cluster in junctions.clusters:
        ends = []
        for arm in cluster.arms:
            cut, n = junctions.cuts[arm.street], arm.street
            if cut is not None:
                s = cut[0] if arm.at_start else cut[1]
                profile = plan.streets[n].profiles[0 if arm.at_start else -1]
                place = curves[n](np.array([s]))[0][0]
                ends.append((place, carriageway_half(profile), _between(along[n], numbers[n], s)))
        for (a, half, one), (b, other, two) in combinations(ends, 2):
            if np.hypot(*(a - b)) - half - other < _BESIDE:
                found.append(HeightTie(one, two, 0.0))
    return found


def levels_along(street: MappedStreet, along: FloatArray) -> IntArray:
    """Layer of the map at distances along a street."""
    steps = np.linalg.norm(np.diff(street.line, axis=0), axis=1)
    ends = np.append(0.0, np.cumsum(steps)) * along[-1] / steps.sum()
    firsts = ends[list(street.breaks)]
    stretch = np.clip(np.searchsorted(firsts, along, "right") - 1, 0, len(firsts) - 1)
    levels: IntArray = np.array([p.level for p in street.profiles])[stretch]
    return levels
