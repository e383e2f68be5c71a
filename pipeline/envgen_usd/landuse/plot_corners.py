"""Fits straight sides and clean corners to the staircase of cells around a plot."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import shapely

from envgen_usd.landuse.cell_ring import CellRing
from envgen_usd.models.array_types import FloatArray, IntArray

TOLERANCE = 1.1
"""Largest distance of step centres from their side, cells; a larger value gives fewer corners."""
SHORTEST = 5
"""Least number of steps of a side; shorter sides are rounded corners.

A larger value drops more sides.
"""
SQUARING = 0.6
"""Largest shift of a side's ends for a right angle, cells; a larger value squares more corners."""
PARALLEL = np.radians(6.0)
"""Largest angle between long sides that are joined, radians; a larger value joins more sides."""
UNSURE = 1.0
"""Angular uncertainty of a side times its number of steps, radians.

A larger value joins more short sides.
"""
LOSS = 0.5
"""Largest change of area by a fit, cells per step of the ring; a larger value accepts worse fits.

"""


@dataclass(frozen=True)
class _Side:
    """A straight side: a point on it, its direction, and its steps."""

    point: FloatArray
    direction: FloatArray
    middles: FloatArray
    shared: bool = False

    @property
    def steps(self) -> int:
        return len(self.middles)


def fit_polygon(
    ring: CellRing, neighbours: IntArray, shared: Mapping[int, FloatArray]
) -> FloatArray:
    """Fits a polygon to the staircase around a plot.

    1. The method of Douglas and Peucker (1973) detects corners.
    2. Each side is the least-squares line through the centres of its steps. A side towards another
       plot is fitted to all shared steps, so that both plots get the same line.
    3. Collinear sides are joined, and rounded corners are dropped.
    4. Sides nearly perpendicular to the longest side are squared.
    5. Neighbouring lines are intersected.

    Args:
        ring: Sides of cells, counter-clockwise.
        neighbours: S, number of the adjacent plot at each step, 0 without a plot.
        shared: By number of a neighbour, all steps (N x 2) towards it.

    Returns:
        N x 2, counter-clockwise, units of cells. If the fit is not a simple polygon of similar
        area, the corners alone are returned; of a strip, which has but two, all steps.
    """
    corners = _corners(ring.middles)
    sides = []
    for first, last in zip(corners, [*corners[1:], corners[0] + len(ring)], strict=True):
        # The corner steps belong to two sides.
        steps = np.arange(first, last + 1) if last - first < 4 else np.arange(first + 1, last)
        steps %= len(ring)
        sides.append(_fit_side(ring.middles[steps], neighbours[steps], shared))
    polygon = _intersect(_join(_square(_join(_without_rounding(_join(sides))))))
    if _agrees(polygon, ring):
        return polygon
    return ring.middles[np.array(corners) % len(ring)] if len(corners) > 2 else ring.middles


def _corners(middles: FloatArray) -> list[int]:
    """Indices of the corner steps, ascending from the step farthest from the centre."""
    start = int(np.argmax(np.sum((middles - middles.mean(axis=0)) ** 2, axis=1)))
    turned = np.roll(middles, -start, axis=0)
    closed = shapely.linestrings(np.concatenate([turned, turned[:1]]))
    kept = shapely.get_coordinates(shapely.simplify(closed, TOLERANCE, preserve_topology=False))
    distance = np.abs(kept[:-1, None] - turned).sum(axis=2)
    return [start + int(index) for index in np.argmin(distance, axis=1)]


def _fit_side(middles: FloatArray, neighbours: IntArray, shared: Mapping[int, FloatArray]) -> _Side:
    line = _least_squares(middles)
    other = int(np.bincount(neighbours).argmax())
    if other not in shared or len(shared[other]) < 2:
        return line
    common = shared[other]
    same = _least_squares(common)
    if np.max(np.abs(_distances(common, same))) > 2 * TOLERANCE:
        return line
    forward = np.sign(same.direction @ line.direction) or 1.0
    return _Side(same.point, forward * same.direction, middles, shared=True)


def _least_squares(middles: FloatArray) -> _Side:
    middle = middles.mean(axis=0)
    direction = np.linalg.svd(middles - middle, full_matrices=False)[2][0]
    forward = np.sign((middles[-1] - middles[0]) @ direction) or 1.0
    return _Side(middle, forward * direction, middles)


def _distances(points: FloatArray, side: _Side) -> FloatArray:
    offset = points - side.point
    distances: FloatArray = offset[:, 1] * side.direction[0] - offset[:, 0] * side.direction[1]
    return distances


def _join(sides: list[_Side]) -> list[_Side]:
    """Joins adjacent collinear sides."""
    kept = list(sides)
    place = 0
    while len(kept) > 3 and place < len(kept):
        first, second = kept[place - 1], kept[place]
        sure = PARALLEL + UNSURE / min(first.steps, second.steps)
        if abs(_angle(first.direction, second.direction)) < sure:
            kept[place - 1] = _joined(first, second)
            del kept[place]
            place = 0
        else:
            place += 1
    return kept


def _without_rounding(sides: list[_Side]) -> list[_Side]:
    return [side for side in sides if side.steps >= SHORTEST]


def _joined(first: _Side, second: _Side) -> _Side:
    if first.shared or second.shared:
        return max(first, second, key=lambda side: (side.shared, side.steps))
    return _least_squares(np.concatenate([first.middles, second.middles]))


def _square(sides: list[_Side]) -> list[_Side]:
    """Rotates sides to right angles with the longest side, if their ends hardly move."""
    longest = max(sides, key=lambda side: side.steps, default=None)
    if longest is None:
        return sides
    result = []
    for side in sides:
        angle = _angle(longest.direction, side.direction)
        turn = np.round(angle / (np.pi / 2)) * (np.pi / 2) - angle
        movable = not side.shared and side is not longest
        if movable and abs(np.sin(turn)) * side.steps / 2 <= SQUARING:
            cosine, sine = np.cos(turn), np.sin(turn)
            turned = np.array([[cosine, -sine], [sine, cosine]]) @ side.direction
            result.append(replace(side, direction=turned))
        else:
            result.append(side)
    return result


def _angle(first: FloatArray, second: FloatArray) -> float:
    """Angle from one direction to the other, counter-clockwise, radians, -π to π."""
    return float(np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second))


def _intersect(sides: list[_Side]) -> FloatArray:
    """Intersections of adjacent sides, N x 2; `None` if adjacent sides are parallel."""
    corners = []
    for first, second in zip([*sides[-1:], *sides[:-1]], sides, strict=True):
        across = first.direction[0] * second.direction[1] - first.direction[1] * second.direction[0]
        if abs(across) < np.sin(PARALLEL / 2):
            return np.empty((0, 2))
        reach = second.point - first.point
        along = (reach[0] * second.direction[1] - reach[1] * second.direction[0]) / across
        corners.append(first.point + along * first.direction)
    return np.array(corners).reshape(-1, 2)


def _agrees(polygon: FloatArray, ring: CellRing) -> bool:
    """True for a simple counter-clockwise polygon that covers nearly the same cells."""
    if len(polygon) < 3:
        return False
    fitted, cells = shapely.Polygon(polygon), shapely.Polygon(ring.middles)
    if not fitted.is_valid or not fitted.exterior.is_ccw:
        return False
    return bool(fitted.symmetric_difference(cells).area <= LOSS * len(ring))
