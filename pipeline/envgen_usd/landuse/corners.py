"""From the staircase of cells around a plot to straight sides and clean corners."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import shapely

from envgen_usd.landuse.ring import CellRing
from envgen_usd.models.arrays import FloatArray, IntArray

TOLERANCE = 1.1
"""Cells by which the middles of a staircase's steps may lie off the side that they stand for."""
SHORTEST = 5
"""Steps of the shortest side; shorter ones are the rounding of a corner."""
SQUARING = 0.6
"""Cells by which the ends of a side may move to make a right angle."""
PARALLEL = np.radians(6.0)
"""Neighbouring long sides at a smaller angle are one side."""
UNSURE = 1.0
"""Radians by which the direction of a side is unsure, divided by its steps."""
LOSS = 0.5
"""Largest area that a fit may win or lose, in cells for each step of the ring."""


@dataclass(frozen=True)
class _Side:
    """A straight side: a point on it, its direction, and the steps that it stands for."""

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

    1. Corners are found by the method of Douglas and Peucker (1973).
    2. Each side is the line of least squares through the middles of its steps. A side towards
       another plot is fitted to all steps that both share, so that both get the same line.
    3. Sides in one line are joined, the rounding of corners is left out.
    4. Sides at nearly a right angle to the longest one are squared.
    5. Neighbouring lines are intersected.

    Args:
        ring: Sides of cells, counter-clockwise.
        neighbours: S, number of the plot beyond each step, 0 for none.
        shared: By number of a neighbour, all steps (N x 2) towards it.

    Returns:
        N x 2, counter-clockwise, units of cells. Where the fit is no simple polygon of about the
        same area: the corners alone.
    """
    corners = _corners(ring.middles)
    sides = []
    for first, last in zip(corners, [*corners[1:], corners[0] + len(ring)], strict=True):
        # The steps at the corners belong to two sides.
        steps = np.arange(first, last + 1) if last - first < 4 else np.arange(first + 1, last)
        steps %= len(ring)
        sides.append(_fit_side(ring.middles[steps], neighbours[steps], shared))
    polygon = _intersect(_join(_square(_join(_without_rounding(_join(sides))))))
    rough = ring.middles[np.array(corners) % len(ring)]
    return polygon if _agrees(polygon, ring) else rough


def _corners(middles: FloatArray) -> list[int]:
    """Indices of the steps at corners, ascending from the one farthest from the centre."""
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
    """Joins neighbours that lie in one line."""
    kept = list(sides)
    place = 0
    while len(kept) > 3 and place < len(kept):
        one, other = kept[place - 1], kept[place]
        sure = PARALLEL + UNSURE / min(one.steps, other.steps)
        if abs(_angle(one.direction, other.direction)) < sure:
            kept[place - 1] = _joined(one, other)
            del kept[place]
            place = 0
        else:
            place += 1
    return kept


def _without_rounding(sides: list[_Side]) -> list[_Side]:
    return [side for side in sides if side.steps >= SHORTEST]


def _joined(one: _Side, other: _Side) -> _Side:
    if one.shared or other.shared:
        return max(one, other, key=lambda side: (side.shared, side.steps))
    return _least_squares(np.concatenate([one.middles, other.middles]))


def _square(sides: list[_Side]) -> list[_Side]:
    """Turns sides to right angles with the longest one where their ends hardly move."""
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


def _angle(one: FloatArray, other: FloatArray) -> float:
    """Radians from one direction to the other, counter-clockwise, -π to π."""
    return float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))


def _intersect(sides: list[_Side]) -> FloatArray:
    """Corners between neighbouring sides, N x 2; none where neighbours are parallel."""
    corners = []
    for one, other in zip([*sides[-1:], *sides[:-1]], sides, strict=True):
        across = one.direction[0] * other.direction[1] - one.direction[1] * other.direction[0]
        if abs(across) < np.sin(PARALLEL / 2):
            return np.empty((0, 2))
        reach = other.point - one.point
        along = (reach[0] * other.direction[1] - reach[1] * other.direction[0]) / across
        corners.append(one.point + along * one.direction)
    return np.array(corners).reshape(-1, 2)


def _agrees(polygon: FloatArray, ring: CellRing) -> bool:
    """True for a simple counter-clockwise polygon over about the same cells."""
    if len(polygon) < 3:
        return False
    made, cells = shapely.Polygon(polygon), shapely.Polygon(ring.middles)
    if not made.is_valid or not made.exterior.is_ccw:
        return False
    return bool(made.symmetric_difference(cells).area <= LOSS * len(ring))
