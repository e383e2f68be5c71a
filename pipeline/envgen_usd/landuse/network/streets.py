"""Hyperparameters along the roads: what is asked for at each roadside."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.landuse.roadside import Roadside
from envgen_usd.landuse.sites import Sites
from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.profile import PlotRules
from envgen_usd.seeds import generator

SWAY = 0.15
"""Largest share by which the width of plots swings along a roadside."""
SWAY_LENGTH = (80.0, 200.0)
"""Metres of a swing."""
MIDDLE = 0.5
"""Share of the front at which a plot is entered."""


@dataclass(frozen=True)
class Street:
    """A roadside and what is asked for along it.

    Attributes:
        side: The roadside.
        frontage: Width of plots, metres.
        row: Plots in a row, before a gap as wide as one plot; 0 if no gap is known of.
        sway: Share of the swing of the width, metres of a swing, its angle at the start.
        depths: Metres, of the plots of each row; the last one goes on.
    """

    side: Roadside
    frontage: float
    row: int
    sway: tuple[float, float, float]
    depths: FloatArray

    def phase(self, along: FloatArray) -> FloatArray:
        """Place along the roadside in plots: whole numbers are where plots begin."""
        share, length, start = self.sway
        wave = 2 * np.pi / length
        swing = share / wave * (np.sin(wave * along + start) - np.sin(start))
        phase: FloatArray = (along + swing) / self.frontage
        return phase

    def left(self, along: FloatArray) -> FloatArray:
        """Plots from a place to the end of its row; negative between rows and past the last."""
        phase = self.phase(along)
        last = self.phase(np.array([self.side.length]))[0]
        if not self.row:
            return np.asarray(last - phase)
        left: FloatArray = self.row - phase % (self.row + 1)
        return np.asarray(np.minimum(left, np.floor(last + 1e-9) - phase))

    def depth(self, along: FloatArray) -> FloatArray:
        """Depth of plots at a place, metres."""
        row = np.floor(self.phase(along) / (self.row + 1)) if self.row else np.zeros(along.shape)
        depth: FloatArray = self.depths[np.clip(row, 0, len(self.depths) - 1).astype(np.int64)]
        return depth

    def stops(self) -> FloatArray:
        """Metres along the roadside at which plots begin and end."""
        along = np.linspace(0.0, self.side.length, max(2, int(2 * self.side.length)))
        phase = self.phase(along)
        return np.interp(np.arange(int(phase[-1] + 1e-9) + 1), phase, along)


def draw_streets(roadsides: Sequence[Roadside], rules: PlotRules, seed: int) -> list[Street]:
    """Draws what is asked for along each roadside, within the ranges of an environment."""
    return [_draw(side, rules, seed) for side in roadsides]


def unknown_streets(roadsides: Sequence[Roadside], rules: PlotRules) -> list[Street]:
    """Streets of which only the environment is known: the middles of its ranges."""
    frontage, depth = sum(rules.frontage) / 2, np.array([sum(rules.depth) / 2])
    return [Street(side, frontage, 0, (0.0, 1.0, 0.0), depth) for side in roadsides]


def _draw(side: Roadside, rules: PlotRules, seed: int) -> Street:
    draw = generator(seed, "landuse", "street", side.road, side.side)
    row = int(draw.integers(max(2, round(rules.group[0])), max(2, round(rules.group[1])) + 1))
    frontage = float(draw.uniform(*rules.frontage))
    sway = (draw.uniform(0, SWAY), draw.uniform(*SWAY_LENGTH), draw.uniform(0, 2 * np.pi))
    rows = 2 + int(side.length / (frontage * (row + 1) * (1 - SWAY)))
    return Street(side, frontage, row, sway, draw.uniform(*rules.depth, rows))


def street_sites(streets: Sequence[Street]) -> Sites:
    """Places for plots as they are asked for; nothing is drawn."""
    spans = [(street, n, _present(street)) for n, street in enumerate(streets)]
    spans = [(street, n, kept) for street, n, kept in spans if street.side.open and len(kept)]
    starts = [street.stops()[kept] for street, _, kept in spans]
    ends = [street.stops()[kept + 1] for street, _, kept in spans]
    pairs = list(zip(spans, starts, ends, strict=True))
    lines = [street.side.fronts(a, b) for (street, _, _), a, b in pairs]
    empty = np.empty((0, 2, 2))
    depths = [street.depth((a + b) / 2) for (street, _, _), a, b in pairs]
    count = sum(map(len, depths))
    return Sites(
        np.concatenate([empty, *(fronts for fronts, _ in lines)]),
        np.concatenate([empty, *(normals for _, normals in lines)]),
        np.concatenate([np.empty(0), *depths]),
        np.concatenate([np.empty(0), *(np.full(len(k), s.side.verge) for s, _, k in spans)]),
        np.full(count, MIDDLE),
        np.zeros(count, dtype=np.int64),
        np.concatenate([np.empty(0, np.bool_), *(k % (s.row + 1) == 0 for s, _, k in spans)]),
        np.concatenate([np.empty(0, dtype=np.int64), *(np.full(len(k), n) for _, n, k in spans)]),
    )


def _present(street: Street) -> IntArray:
    """Numbers of the plots that are there."""
    numbers: IntArray = np.arange(max(0, len(street.stops()) - 1))
    return numbers[numbers % (street.row + 1) < street.row] if street.row else numbers
