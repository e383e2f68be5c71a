"""Hyperparameters along the roads: the requested plots of each roadside."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.landuse.plot_sites import Sites
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.landuse.site_fitting import fit_sites
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.distribution import drawn
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

SWAY = 0.15
"""Largest relative variation of plot widths along a roadside; a larger value varies widths more."""
SWAY_LENGTH = (80.0, 200.0)
"""Range of wavelengths of that variation, metres."""
MIDDLE = 0.5
"""Position of the entrance as a share of the front."""


@dataclass(frozen=True)
class Street:
    """A roadside and its requested plots.

    Attributes:
        side: Roadside.
        frontage: Width of plots, metres.
        sway: Relative variation of the width, its wavelength in metres, and its initial phase.
        present: True for each existing plot, in order; empty if unknown.
        depths: Depth of each plot, metres; a single number if plots are unknown.
    """

    side: Roadside
    frontage: float
    sway: tuple[float, float, float]
    present: BoolArray
    depths: FloatArray

    def phase(self, along: FloatArray) -> FloatArray:
        """Position along the roadside in plots; plots begin at integers."""
        share, length, start = self.sway
        wave = 2 * np.pi / length
        swing = share / wave * (np.sin(wave * along + start) - np.sin(start))
        phase: FloatArray = (along + swing) / self.frontage
        return phase

    def left(self, along: FloatArray) -> FloatArray:
        """Plots from a position to the end of its row; 0 down to -1 in gaps."""
        phase = self.phase(along)
        if not len(self.present):
            return np.asarray(self.phase(np.array([self.side.length]))[0] - phase)
        number = np.clip(phase, 0, len(self.present)).astype(np.int64)
        left: FloatArray = np.maximum(self._changes()[number] - phase, -1.0)
        return left

    def depth(self, along: FloatArray) -> FloatArray:
        """Depth of plots at a position, metres."""
        number = np.clip(self.phase(along), 0, len(self.depths) - 1).astype(np.int64)
        depth: FloatArray = self.depths[number]
        return depth

    def stops(self) -> FloatArray:
        """Arc lengths at which plots begin and end, metres."""
        along = np.linspace(0.0, self.side.length, max(2, int(2 * self.side.length)))
        phase = self.phase(along)
        return np.interp(np.arange(int(phase[-1] + 1e-9) + 1), phase, along)

    def _changes(self) -> IntArray:
        """End of the row of each plot, or start of its gap."""
        numbers = np.arange(len(self.present) + 1)
        there = np.append(self.present, False)
        ends = np.minimum.accumulate(np.where(there, len(there), numbers)[::-1])[::-1]
        begins = ~there & np.concatenate([[True], there[:-1]])
        gaps = np.maximum.accumulate(np.where(begins, numbers, 0))
        changes: IntArray = np.where(there, ends, gaps)
        return changes


def draw_streets(roadsides: Sequence[Roadside], rules: PlotRules, seed: int) -> list[Street]:
    """Draws the requested plots of each roadside, within the ranges of an environment."""
    return [_draw(side, rules, seed) for side in roadsides]


def unknown_streets(roadsides: Sequence[Roadside], rules: PlotRules) -> list[Street]:
    """Streets with the middles of the environment's ranges, without requested plots."""
    frontage, depth = sum(rules.frontage) / 2, np.array([sum(rules.depth) / 2])
    nothing = np.empty(0, dtype=np.bool_)
    return [Street(side, frontage, (0.0, 1.0, 0.0), nothing, depth) for side in roadsides]


def fit_streets(streets: Sequence[Street], surface: RoadSurface, rules: PlotRules) -> list[Street]:
    """Requests only plots clear of roads and of each other, with reduced depth if necessary.

    The geometry is that of the rules (`fit_sites`): a hard constraint that is not learnt.
    """
    sites = street_sites(streets)
    fitting = fit_sites(sites, surface, rules)
    places = {key: n for n, key in enumerate(_keys(sites))}
    kept = np.array([places[key] for key in _keys(fitting)], dtype=np.int64)
    numbers = np.concatenate([np.empty(0, np.int64), *(_numbers(s) for s in streets)])
    fitted = []
    for number, street in enumerate(streets):
        here = fitting.sides == number
        present, depths = np.zeros_like(street.present), street.depths.copy()
        present[numbers[kept[here]]] = True
        depths[numbers[kept[here]]] = fitting.depths[here]
        fitted.append(replace(street, present=present, depths=depths))
    return fitted


def street_sites(streets: Sequence[Street]) -> Sites:
    """Sites of the requested plots; nothing is drawn."""
    parts = [(street, n, _numbers(street)) for n, street in enumerate(streets)]
    parts = [(street, n, numbers) for street, n, numbers in parts if len(numbers)]
    starts = [street.stops()[numbers] for street, _, numbers in parts]
    ends = [street.stops()[numbers + 1] for street, _, numbers in parts]
    spans = zip(parts, starts, ends, strict=True)
    lines = [street.side.fronts(start, end) for (street, _, _), start, end in spans]
    empty = np.empty((0, 2, 2))
    depths = np.concatenate([np.empty(0), *(s.depths[numbers] for s, _, numbers in parts)])
    return Sites(
        np.concatenate([empty, *(fronts for fronts, _ in lines)]),
        np.concatenate([empty, *(normals for _, normals in lines)]),
        depths,
        np.concatenate([np.empty(0), *(np.full(len(k), s.side.verge) for s, _, k in parts)]),
        np.full(len(depths), MIDDLE),
        np.zeros(len(depths), dtype=np.int64),
        np.concatenate([np.empty(0, np.bool_), *(np.diff(k, prepend=-2) > 1 for *_, k in parts)]),
        np.concatenate([np.empty(0, np.int64), *(np.full(len(k), n) for _, n, k in parts)]),
    )


def _draw(side: Roadside, rules: PlotRules, seed: int) -> Street:
    draw = generator(seed, "landuse", "street", side.road, side.side)
    row = int(draw.integers(max(2, round(rules.group[0])), max(2, round(rules.group[1])) + 1))
    frontage = drawn(draw, rules.frontage)
    sway = (draw.uniform(0, SWAY), draw.uniform(*SWAY_LENGTH), draw.uniform(0, 2 * np.pi))
    rows = 2 + int(side.length / (frontage * (row + 1) * (1 - SWAY)))
    depths = drawn(draw, rules.depth, rows)
    bare = Street(side, frontage, sway, np.empty(0, dtype=np.bool_), depths)
    numbers = np.arange(max(1, len(bare.stops()) - 1))
    present = (numbers % (row + 1) < row) & (numbers < len(bare.stops()) - 1)
    return replace(bare, present=present, depths=depths[numbers // (row + 1)])


def _numbers(street: Street) -> IntArray:
    """Numbers of the existing plots; empty for closed roadsides."""
    numbers: IntArray = np.flatnonzero(street.present & street.side.open)
    return numbers


def _keys(sites: Sites) -> list[tuple[int, bytes]]:
    """Key of each site: roadside and front."""
    fronts = (front.tobytes() for front in sites.fronts)
    return list(zip(sites.sides.tolist(), fronts, strict=True))
