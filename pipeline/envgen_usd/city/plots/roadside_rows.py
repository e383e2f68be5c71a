"""Rows of things beside a road at even distances: street lights, street trees."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.headings import heading_of
from envgen_usd.geometry.square_index import are_near
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.distribution import Range, drawn
from envgen_usd.models.road_surface import RoadLine


class RowRules(Protocol):
    """Where the things of a row stand; see `StreetLightRules`."""

    @property
    def spacing(self) -> Range:
        """Metres between neighbours on one side."""

    @property
    def jitter(self) -> float:
        """Largest displacement along the road as a share of the spacing."""

    @property
    def offset(self) -> Range:
        """Metres from the road's outer border."""

    @property
    def sides(self) -> str:
        """``one``, ``both`` or ``alternating``."""


@dataclass(frozen=True)
class RowPlace:
    """A place of a row.

    Attributes:
        number: Number along the road and side of the road, e.g. ``3l``.
        position: 2, metres, road frame.
        heading: Direction towards the road, radians.
    """

    number: str
    position: FloatArray
    heading: float


def row_places(
    line: RoadLine,
    rules: RowRules,
    draws: np.random.Generator,
    chunk: Chunk,
    around: float = 0.0,
) -> Iterator[RowPlace]:
    """Places of a road's row that may lie in a chunk; draws the same for all chunks.

    Args:
        line: The road.
        rules: Spacing and sides of the row.
        draws: Random generator of the row.
        chunk: Tile.
        around: Metres around the chunk in which further places are wanted.
    """
    spacing, first, coin = drawn(draws, rules.spacing), draws.random(), draws.random() < 0.5
    # Alternating things have the spacing on each side.
    step = spacing / 2 if rules.sides == "alternating" else spacing
    count = int(line.s[-1] / step) + 1
    jitter = rules.jitter * spacing * draws.uniform(-1.0, 1.0, (count, 2))
    offsets = drawn(draws, rules.offset, (count, 2))
    index, side = _sides(rules.sides, count, int(coin))
    s = (index + first) * step + jitter[index, side]
    chosen = (s >= 0.0) & (s <= line.s[-1]) & _near(line, s, rules, chunk, around)
    for number, where, at in zip(index[chosen], side[chosen], s[chosen], strict=True):
        place, heading = _beside(line, at, where, float(offsets[number, where]))
        yield RowPlace(f"{number}{'lr'[where]}", place, heading)


def _sides(rule: str, count: int, coin: int) -> tuple[IntArray, IntArray]:
    """Number of each thing along the road, and its side: 0 left, 1 right."""
    index = np.arange(count)
    if rule == "both":
        return np.repeat(index, 2), np.tile([0, 1], count)
    return index, (index + coin) % 2 if rule == "alternating" else np.full(count, coin)


def _near(line: RoadLine, s: FloatArray, rules: RowRules, chunk: Chunk, around: float) -> BoolArray:
    """Whether what stands beside a road at each s may stand in a chunk or around it."""
    plan = np.column_stack([np.interp(s, line.s, line.points[:, axis]) for axis in (0, 1)])
    reach = float(np.abs([line.t_left, line.t_right]).max(initial=0.0)) + max(rules.offset) + around
    return are_near(plan, chunk.bounds, reach)


def _beside(line: RoadLine, s: float, side: int, offset: float) -> tuple[FloatArray, float]:
    x, y = (np.interp(s, line.s, line.points[:, axis]) for axis in (0, 1))
    along = float(np.interp(s, line.s, np.unwrap(line.heading)))
    t = np.interp(s, line.s, line.t_left) + offset
    if side == 1:
        t = np.interp(s, line.s, line.t_right) - offset
    place = np.array([x - t * np.sin(along), y + t * np.cos(along)])
    towards = along - np.pi / 2 if side == 0 else along + np.pi / 2
    return place, heading_of(np.array([np.cos(towards), np.sin(towards)]))
