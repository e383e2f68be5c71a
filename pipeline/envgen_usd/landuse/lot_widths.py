"""Plots in a row along a street, as wide as an environment asks.

Sampled cells tell where plots are, and for which ground; houses that stand close melt into one, so
that a plot may hold several. The environment knows how wide one is.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.distribution import Range, mean_of, value_at

_TAILS = (0.05, 0.95)
"""Shares of the asked widths below which a plot is narrow, and above which it is wide."""


@dataclass(frozen=True)
class Lot:
    """A plot in the frame of its roadside: metres along the line, and away from it.

    Attributes:
        number: Different for each plot.
        side: Index of its roadside.
        start: Where it begins along the roadside.
        end: Where it ends.
        near: Distance to the street.
        depth: From its front on.
        entrance: Position of the entrance, as a share of the front.
    """

    number: int
    side: int
    start: float
    end: float
    near: float
    depth: float
    entrance: float

    @property
    def width(self) -> float:
        """Length of the front."""
        return self.end - self.start


def with_asked_widths(
    lots: Sequence[Lot], roadsides: Sequence[Roadside], frontage: Range
) -> list[Lot]:
    """Joins lots that are narrower than an environment asks, and divides wider ones.

    1. A narrow lot joins the next one, the narrower of two, across land on which no lot has room.
    2. A narrow lot that is alone takes the land beside it.
    3. A wide lot is divided into equal parts.

    Args:
        lots: Those at the street, ordered along their roadsides.
        roadsides: Roadsides of the whole map.
        frontage: Widths that the environment asks for, metres.
    """
    least, largest = (value_at(frontage, share) for share in _TAILS)
    asked = _Asked(least, largest, mean_of(frontage))
    joined = [lot for row in _rows(lots, asked.least) for lot in _joined(row, asked.least)]
    wide = _widened(joined, roadsides, asked.least)
    parts = [part for lot in wide for part in _divided(lot, asked.parts(lot.width))]
    return [replace(part, number=number) for number, part in enumerate(parts)]


@dataclass(frozen=True)
class _Asked:
    """Widths that are asked for, metres."""

    least: float
    largest: float
    mean: float

    def parts(self, width: float) -> int:
        """Number of equal parts, as near to the mean as parts that are not too narrow can be."""
        if width <= self.largest:
            return 1
        wanted = max(round(width / self.mean), math.ceil(width / self.largest))
        return max(1, min(wanted, int(width / self.least)))


def _rows(lots: Sequence[Lot], least: float) -> list[list[Lot]]:
    """Lots between which no further one has room."""
    rows: list[list[Lot]] = []
    for lot in lots:
        before = rows[-1][-1] if rows else None
        if before and before.side == lot.side and 0.0 <= lot.start - before.end < least:
            rows[-1].append(lot)
        else:
            rows.append([lot])
    return rows


def _joined(row: Sequence[Lot], least: float) -> list[Lot]:
    """The lots of a row, none narrower than the least unless it is the only one."""
    lots = list(row)
    while len(lots) > 1:
        widths = [lot.width for lot in lots]
        number = int(np.argmin(widths))
        if widths[number] >= least:
            break
        others = [n for n in (number - 1, number + 1) if 0 <= n < len(lots)]
        first, last = sorted((number, min(others, key=lambda n: widths[n])))
        lots[first : last + 1] = [_union(lots[first], lots[last])]
    return lots


def _union(one: Lot, other: Lot) -> Lot:
    """Two neighbours and what lies between them, as deep as both on average."""
    whole = replace(one, end=other.end)
    wider = max(one, other, key=lambda lot: lot.width)
    entrance = (wider.start + wider.entrance * wider.width - one.start) / whole.width
    depth = (one.width * one.depth + other.width * other.depth) / (one.width + other.width)
    return replace(whole, depth=depth, entrance=entrance)


def _widened(lots: Sequence[Lot], roadsides: Sequence[Roadside], least: float) -> list[Lot]:
    """Lots of which the narrow ones are as wide as the land between their neighbours allows."""
    result: list[Lot] = []
    for number, lot in enumerate(lots):
        lacking = max(0.0, least - lot.width)
        low, high = 0.0, roadsides[lot.side].length
        if result and result[-1].side == lot.side:
            low = result[-1].end
        if number + 1 < len(lots) and lots[number + 1].side == lot.side:
            high = lots[number + 1].start
        before = min(lacking / 2.0, max(0.0, lot.start - low))
        after = min(lacking - before, max(0.0, high - lot.end))
        before = min(lacking - after, max(0.0, lot.start - low))
        start, end = lot.start - before, lot.end + after
        place = lot.start + lot.entrance * lot.width
        entrance = (place - start) / (end - start)
        result.append(replace(lot, start=start, end=end, entrance=entrance))
    return result


def _divided(lot: Lot, count: int) -> Iterator[Lot]:
    """Equal parts of a lot, each with an entrance in the middle."""
    if count == 1:
        yield lot
        return
    lines = np.linspace(lot.start, lot.end, count + 1).tolist()
    for start, end in pairwise(lines):
        yield replace(lot, start=start, end=end, entrance=0.5)
