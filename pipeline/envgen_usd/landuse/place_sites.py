"""Candidate sites for plots along streets, from plots and buildings as cells.

1. A plot opens onto the street that its building faces: the nearest one with the building straight
   beside it.
2. Its sides are where its cells end beside the building, across the street's direction. Neighbours
   share the line between them.
3. It begins at the street, or behind the plots before it, and is as deep as its area asks for.
4. Plots at the street are as wide as their environment asks (`lot_widths.py`).
5. The way to a plot behind others runs along a line between these, which move apart for it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.landuse.lot_widths import Lot, with_asked_widths
from envgen_usd.landuse.place_landuse import PlaceLand
from envgen_usd.landuse.plot_rectangles import least_rectangle
from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.land_rules import PlotRules

FARTHEST = 60.0
"""Longest way from a street to a building, metres; a larger value reaches farther streets."""
AT_STREET = 9.0
"""Largest distance between street and plot without plots before it, metres.

A larger value moves more plots to the street.
"""
SHARED = 3.0
"""Largest gap between the sides of two neighbours that share a line, metres."""
_NARROWEST = 4.0
"""Least width of cells that are a plot, metres; a larger value drops more of them."""
BEHIND = 1.0
"""Least land behind a building, metres."""
WAY = 3.5
"""Width of the land between plots for the way to one behind them, metres."""
_STEP = 1.0
_ENDS = (4.0, 96.0)
"""Percentiles of cells that count as their first and last: rounded corners lie outside."""
_STRAIGHT = 0.7
ENTRANCE = (0.2, 0.8)
"""Positions of an entrance, as a share of the front."""


def place_sites(
    land: PlaceLand, corner: tuple[int, int], roadsides: Sequence[Roadside], rules: PlotRules
) -> Sites:
    """Sites of all plots with a building, those at the street first.

    Args:
        land: A map's cells.
        corner: Column and row of its first cell on the map's lattice.
        roadsides: Roadsides of the whole map.
        rules: Widths that the environment asks for.

    Returns:
        Sites, all with row 0; a plot behind others keeps its distance to the street.
    """
    streets = _Streets(roadsides)
    found = [_lot(cells, number, streets) for number, cells in _plot_cells(land, corner)]
    lots = [lot for lot in found if lot is not None]
    front = sorted((lot for lot in lots if lot.near == 0.0), key=lambda lot: (lot.side, lot.start))
    behind = [lot for lot in lots if lot.near > 0.0]
    front = with_asked_widths(_with_shared_lines(front), roadsides, rules.frontage)
    front, behind = _with_ways(front, behind)
    behind.sort(key=lambda lot: (lot.near, lot.side, lot.start))
    least, _ = least_rectangle(rules)
    kept = [lot for lot in (*front, *behind) if lot.width >= least]
    return _sites(kept, roadsides)


@dataclass(frozen=True)
class _Cells:
    """Centres of the cells of a plot, and of its building, N x 2, metres."""

    plot: FloatArray
    house: FloatArray


def _plot_cells(land: PlaceLand, corner: tuple[int, int]) -> list[tuple[int, _Cells]]:
    result = []
    for number, box in enumerate(ndimage.find_objects(land.plots), 1):
        if box is None:
            continue
        inside = land.plots[box] == number
        house = inside & land.built[box]
        if house.any():
            first = np.array([corner[0] + box[1].start, corner[1] + box[0].start])
            cells = (np.argwhere(one)[:, ::-1] + first + 0.5 for one in (inside, house))
            result.append((number, _Cells(*(one * CELL_SIZE for one in cells))))
    return result


class _Streets:
    """Places along all open roadsides."""

    def __init__(self, roadsides: Sequence[Roadside]) -> None:
        self.roadsides = roadsides
        parts = [
            (np.full(len(along), number), along, *side.at(along))
            for number, side in enumerate(roadsides)
            if side.open
            for along in [np.linspace(0.0, side.length, int(side.length / _STEP) + 2)]
        ]
        nothing = (np.empty(0, np.int64), np.empty(0), np.empty((0, 2)), np.empty((0, 2)))
        columns = zip(nothing, *parts, strict=True)
        self.side, self.along, self.points, self.normals = map(np.concatenate, columns)
        self._tree = cKDTree(self.points) if len(self.points) else None

    def facing(self, place: FloatArray) -> int | None:
        """Index of the nearest place on a street that a building faces; `None` without one."""
        if self._tree is None:
            return None
        near = np.array(self._tree.query_ball_point(place, FARTHEST), np.int64)
        offset = place - self.points[near]
        distance = np.linalg.norm(offset, axis=1)
        ahead = np.einsum("nc,nc->n", offset, self.normals[near])
        for least in (np.sqrt(np.maximum(distance**2 - _STEP**2, 0.0)), _STRAIGHT * distance):
            fits = (ahead > 0.0) & (ahead >= least)
            if fits.any():
                return int(near[fits][np.argmin(distance[fits])])
        return None


def _lot(cells: _Cells, number: int, streets: _Streets) -> Lot | None:
    """The plot in the frame of its street; see rules 1 to 3."""
    foot = streets.facing(cells.house.mean(axis=0))
    if foot is None:
        return None
    point, normal = streets.points[foot], streets.normals[foot]
    axes = np.array([[normal[1], -normal[0]], normal]).T
    plot, house = ((one - point) @ axes for one in (cells.plot, cells.house))
    left, right = np.percentile(house[:, 0], _ENDS)
    first, last = np.percentile(house[:, 1], _ENDS)
    beside = plot[(plot[:, 1] >= first) & (plot[:, 1] <= last), 0]
    before = plot[(plot[:, 0] >= left) & (plot[:, 0] <= right), 1]
    if not len(beside) or not len(before) or last <= 0.0:
        return None
    half, side = CELL_SIZE / 2.0, int(streets.side[foot])
    ends = np.percentile(beside, _ENDS) + [-half, half] + streets.along[foot]
    start, end = np.clip(ends, 0.0, streets.roadsides[side].length)
    near = float(np.percentile(before, _ENDS[0])) - half
    near = near if near > AT_STREET else 0.0
    if end - start < _NARROWEST:
        return None
    asked = np.count_nonzero(plot[:, 1] > near) * CELL_SIZE**2 / (end - start)
    deepest = plot[:, 1].max() + half - near
    depth = max(min(asked, deepest), last + BEHIND - near)
    middle = ((left + right) / 2.0 + streets.along[foot] - start) / (end - start)
    return Lot(number, side, start, end, near, depth, float(np.clip(middle, *ENTRANCE)))


def _with_shared_lines(lots: Sequence[Lot]) -> list[Lot]:
    """Lots at the street, in order, with a single line between neighbours."""
    lines = {lot.number: [lot.start, lot.end] for lot in lots}
    for one, other in pairwise(lots):
        gap = other.start - one.end
        least = min(one.end - one.start, other.end - other.start)
        if one.side == other.side and -least / 2.0 < gap < SHARED:
            middle = (one.end + other.start) / 2.0
            lines[one.number][1] = lines[other.number][0] = middle
    return [replace(lot, start=lines[lot.number][0], end=lines[lot.number][1]) for lot in lots]


def _with_ways(front: Sequence[Lot], behind: Sequence[Lot]) -> tuple[list[Lot], list[Lot]]:
    """Leaves land between the lots at the street for ways to those behind; see rule 4."""
    lines = {lot.number: [lot.start, lot.end] for lot in front}
    entered = []
    for lot in behind:
        low, high = lot.start + WAY / 2.0, lot.end - WAY / 2.0
        ends = [end for one in front if one.side == lot.side for end in (one.start, one.end)]
        usable = [end for end in ends if low <= end <= high]
        middle = (lot.start + lot.end) / 2.0
        way = min(usable, key=lambda end: abs(end - middle)) if usable else middle
        for one in front if usable else ():
            if one.side == lot.side and abs(one.start - way) < 1e-6:
                lines[one.number][0] = way + WAY / 2.0
            elif one.side == lot.side and abs(one.end - way) < 1e-6:
                lines[one.number][1] = way - WAY / 2.0
        entered.append(replace(lot, entrance=(way - lot.start) / (lot.end - lot.start)))
    moved = [replace(lot, start=lines[lot.number][0], end=lines[lot.number][1]) for lot in front]
    return moved, entered


def _sites(lots: Sequence[Lot], roadsides: Sequence[Roadside]) -> Sites:
    fronts, normals = np.empty((len(lots), 2, 2)), np.empty((len(lots), 2, 2))
    sides = np.array([lot.side for lot in lots], np.int64)
    start, end, near, depth, entrance = (
        np.array([getattr(lot, name) for lot in lots], np.float64)
        for name in ("start", "end", "near", "depth", "entrance")
    )
    for number in np.unique(sides).tolist():
        here = sides == number
        fronts[here], normals[here] = roadsides[number].fronts(start[here], end[here])
    verges = np.array([side.verge for side in roadsides])[sides] if len(lots) else np.empty(0)
    return Sites(
        fronts + near[:, None, None] * normals,
        normals,
        depth,
        verges + near,
        entrance,
        np.zeros(len(lots), np.int64),
        np.ones(len(lots), np.bool_),
        sides,
    )
