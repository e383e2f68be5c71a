"""Candidate sites for plots along roadsides, drawn by rules before any check for space."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.roadside import Roadside
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.distribution import Range, drawn, drawn_count
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.seeds import generator

BACK_LANE = 4.5
"""Width of the lane between two rows of plots, metres; a larger value widens back lanes."""
LANE_JOINT = 1.0
"""Overlap of the lane's pieces before adjacent plots, for bends, metres.

A larger value closes wider gaps.
"""
ACCESS_SHARE = 0.12
"""Width of an entrance as a share of the plot's front; a larger value widens entrances."""
NARROWEST = 0.75
"""Width of the only plot of a short street, as a share of the least width elsewhere.

A larger value leaves more short streets empty.
"""
ACCESS_WIDTH: Range = (1.6, 6.0)
"""Range of entrance widths, metres."""
LONG_WAY = (10.0, 3.0)
"""Length from which a way passes between other plots, and its largest width there, metres.

`place_sites.WAY` is the land that these leave for it.
"""
FARTHEST = 25.0
"""Longest way from the street to a plot in the first row, metres.

A larger value reaches farther roads.
"""


@dataclass(frozen=True)
class Sites:
    """Candidate sites for plots, in order of precedence.

    Attributes:
        fronts: P x 2 x 2, ends of the street side; the plot lies to the left.
        normals: P x 2 x 2, directions of the sides, away from the street.
        depths: P, metres.
        before: P, distance between the road's border and the front, metres.
        entrances: P, position of the entrance as a share of the front.
        rows: P, 0 for plots at the street.
        heads: P, true for the first plot of a row.
        sides: P, index of the roadside.
    """

    fronts: FloatArray
    normals: FloatArray
    depths: FloatArray
    before: FloatArray
    entrances: FloatArray
    rows: IntArray
    heads: BoolArray
    sides: IntArray

    def __len__(self) -> int:
        """Number of sites."""
        return len(self.depths)

    def take(self, index: IntArray, shares: FloatArray) -> "Sites":
        """Selected sites, with a share of their depth."""
        kept = {field.name: getattr(self, field.name)[index] for field in fields(self)}
        return Sites(**{**kept, "depths": kept["depths"] * shares})

    def polygons(self, share: float = 1.0) -> FloatArray:
        """Corners, P x 4 x 2, counter-clockwise from the front, with a share of the depth."""
        backs = self.fronts + share * self.depths[:, None, None] * self.normals
        return np.concatenate([self.fronts, backs[:, ::-1]], axis=1)

    def driveways(self, inside: float, outline: Outline) -> FloatArray:
        """Paved ways into the plots, P x 4 x 2.

        Each starts at the road, or at the lane before a back row. It ends `inside` metres behind
        the front, but at most a third of the depth into the plot.

        Args:
            inside: Length inside the plot, metres.
            outline: Outline of the road; in bends it is farther from the middle of a front than
                from its ends.
        """
        along = self.fronts[:, 1] - self.fronts[:, 0]
        lengths = np.linalg.norm(along, axis=1)
        is_long = (self.rows == 0) & (self.before > LONG_WAY[0])
        widest = np.where(is_long, LONG_WAY[1], ACCESS_WIDTH[1])
        width = np.clip(ACCESS_SHARE * lengths, ACCESS_WIDTH[0], widest)
        half = along * (width / lengths / 2)[:, None]
        middle = self.fronts[:, 0] + self.entrances[:, None] * along
        normal = self.normals.mean(axis=1)
        street = np.maximum(self.before, outline.nearest(middle, FARTHEST)[0]) + 1.0
        street = np.where(np.isfinite(street), street, self.before + 1.0)
        out = np.where(self.rows > 0, BACK_LANE, street)[:, None] * normal
        into = np.minimum(inside, self.depths / 3)[:, None] * normal
        corners = (middle - half - out, middle + half - out, middle + half + into)
        return np.stack([*corners, middle - half + into], axis=1)

    def lanes(self) -> FloatArray:
        """Lanes to and along back rows, L x 4 x 2."""
        back = self.rows > 0
        fronts, normals = self.fronts[back], self.normals[back]
        step = fronts[:, 1] - fronts[:, 0]
        step *= LANE_JOINT / np.linalg.norm(step, axis=1, keepdims=True)
        joined = fronts + np.stack([-step, step], axis=1)
        along = np.concatenate([joined - BACK_LANE * normals, joined[:, ::-1]], axis=1)
        head = back & self.heads
        corner, normal = self.fronts[head, 0], self.normals[head, 0]
        sideways = np.stack([-normal[:, 1], normal[:, 0]], axis=1) * BACK_LANE
        street = corner - (self.before[head, None] + 1.0) * normal
        link = np.stack([street + sideways, street, corner, corner + sideways], axis=1)
        return np.concatenate([along, link])


def draw_sites(roadsides: Sequence[Roadside], rules: PlotRules, seed: int) -> Sites:
    """Draws plots along all open roadsides.

    Groups of adjacent plots alternate with gaps. Plots of a row share their depth, so that their
    backs align.
    """
    parts = [_draw_along(side, n, rules, seed) for n, side in enumerate(roadsides) if side.open]
    return Sites(
        *(
            np.concatenate([_EMPTY[field.name], *(getattr(part, field.name) for part in parts)])
            for field in fields(Sites)
        )
    )


_EMPTY = {
    "fronts": np.empty((0, 2, 2)),
    "normals": np.empty((0, 2, 2)),
    "depths": np.empty(0),
    "before": np.empty(0),
    "entrances": np.empty(0),
    "rows": np.empty(0, dtype=np.int64),
    "heads": np.empty(0, dtype=np.bool_),
    "sides": np.empty(0, dtype=np.int64),
}


def _draw_along(side: Roadside, number: int, rules: PlotRules, seed: int) -> Sites:
    draw = generator(seed, "landuse", "plots", side.road, side.side)
    spans: list[FloatArray] = []
    place = draw.uniform(0.0, min(rules.gap[1], max(side.length - rules.frontage[1], 0.0)))
    while place < side.length:
        count = drawn_count(draw, rules.group)
        widths = drawn(draw, rules.frontage, count)
        depths = drawn(draw, rules.depth, rules.rows)
        stops = place + np.concatenate([[0.0], np.cumsum(widths)])
        if draw.uniform() < rules.occupancy:
            spans += _rows_of_group(_ended(stops, side.length, rules), depths, side.verge)
        place = stops[-1] + drawn(draw, rules.gap)
    start, end, before, depth, row, head = np.concatenate([np.empty((0, 6)), *spans]).T
    fronts, normals = side.fronts(start, end)
    return Sites(
        fronts + (before - side.verge)[:, None, None] * normals,
        normals,
        depth,
        before,
        draw.uniform(0.2, 0.8, len(depth)),
        row.astype(np.int64),
        head > 0,
        np.full(len(depth), number),
    )


def _ended(stops: FloatArray, length: float, rules: PlotRules) -> FloatArray:
    """Borders between plots up to the street's end; the last plot may be narrower."""
    kept = stops[stops <= length]
    least = rules.frontage[0] * (NARROWEST if len(kept) == 1 else 1.0)
    if len(kept) == len(stops) or length - kept[-1] < least:
        return kept
    return np.append(kept, length)


def _rows_of_group(stops: FloatArray, depths: FloatArray, verge: float) -> list[FloatArray]:
    """Returns start, end, distance to the road, depth, row, first of its row, by row and plot."""
    rows = []
    for row, depth in enumerate(depths):
        before = verge + depths[:row].sum() + row * BACK_LANE
        same = np.broadcast_to([before, depth, row], (len(stops) - 1, 3))
        rows.append(np.column_stack([stops[:-1], stops[1:], same, np.arange(len(same)) == 0]))
    return rows
