"""The surface of the map below actors."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.traffic.triangle_heights import TriangleHeights, least_cost

_CELL = 4.0
"""Side of the cells by which far triangles are left out, metres."""
_ON_GROUND = 0.3
"""Metres by which the ground has to be nearer to the guess than a road; a larger value keeps more
actors on roads."""
_LEVELS = 0.5
"""Least difference of two levels, metres: surfaces nearer to each other need no guess."""


@dataclass(frozen=True)
class ContactSurface:
    """Roads and ground as triangles.

    Attributes:
        roads: T x 3 x 3, metres, road frame.
        ground: T x 3 x 3, metres; counts where no road is.
    """

    roads: FloatArray
    ground: FloatArray

    def near(self, points: FloatArray) -> "ContactSurface":
        """Returns the triangles near points, N x 2, metres, so that fewer have to be sorted."""
        cells = np.unique(np.floor(points[:, :2] / _CELL).astype(np.int64), axis=0)
        return ContactSurface(_near(self.roads, cells), _near(self.ground, cells))

    @cached_property
    def _triangles(self) -> tuple[TriangleHeights, TriangleHeights]:
        return TriangleHeights(self.roads), TriangleHeights(self.ground)

    def heights(self, points: FloatArray, guess: FloatArray) -> FloatArray:
        """Returns the height of the surface at points, N, metres; NaN beside the map.

        Args:
            points: N x 2, metres.
            guess: N, metres; where surfaces lie above one another, the nearest counts. NaN prefers
                roads, and the highest of them.
        """
        row, height, ground = self._candidates(points)
        aim = guess[row]
        cost = np.where(np.isnan(aim), -height, np.abs(height - aim)) + _ON_GROUND * ground
        cost[np.isnan(aim) & ground] = np.inf
        return least_cost(row, height, cost, len(points))

    def levels(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns the lowest and the highest surface at points, N each; NaN beside the map."""
        row, height, _ = self._candidates(points)
        lowest = least_cost(row, height, height, len(points))
        return lowest, least_cost(row, height, -height, len(points))

    def _candidates(self, points: FloatArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Point, height, and whether it is ground, of each triangle over or under a point."""
        (on_road, roads), (on_ground, ground) = (each.at(points) for each in self._triangles)
        kind = np.repeat([False, True], [len(on_road), len(on_ground)])
        return np.concatenate([on_road, on_ground]), np.concatenate([roads, ground]), kind


def _near(corners: FloatArray, cells: IntArray) -> FloatArray:
    """Triangles whose box touches one of these cells or its neighbours."""
    if not len(corners) or not len(cells):
        return corners[:0]
    base = cells.min(axis=0) - 2
    size = cells.max(axis=0) - base + 3
    taken = np.zeros(size, dtype=np.int64)
    place = cells - base
    for x in (-1, 0, 1):
        for y in (-1, 0, 1):
            taken[place[:, 0] + x, place[:, 1] + y] = 1
    # Sums over rectangles of cells tell whether a box of any size touches a taken one.
    sums = np.pad(taken.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    low = np.floor(corners[:, :, :2].min(axis=1) / _CELL).astype(np.int64) - base
    high = np.floor(corners[:, :, :2].max(axis=1) / _CELL).astype(np.int64) - base + 1
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    count = (
        sums[high[:, 0], high[:, 1]]
        - sums[low[:, 0], high[:, 1]]
        - sums[high[:, 0], low[:, 1]]
        + sums[low[:, 0], low[:, 1]]
    )
    near: FloatArray = corners[count > 0]
    return near


def guessed_heights(surface: ContactSurface, places: FloatArray) -> FloatArray:
    """Returns a guess of the surface's height at the places of an actor in order, N.

    Where surfaces lie above one another, a height of the trace decides, or else those before and
    after: an actor does not jump between a bridge and the road below it.

    Args:
        surface: Roads and ground.
        places: N x 3, metres; the height is NaN where the trace gives none.
    """
    low, high = surface.levels(places)
    single = high - low < _LEVELS
    guess = np.where(single, (low + high) / 2, places[:, 2])
    open_ = np.isnan(guess) & ~np.isnan(low)
    if open_.any() and single.any():
        guess[open_] = np.interp(np.flatnonzero(open_), np.flatnonzero(single), guess[single])
    return guess
