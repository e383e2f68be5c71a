"""Kerb stones: the edge of a raised sidewalk, seen from above."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.geometry.flat_arrays import true_runs
from envgen_usd.models.array_types import BoolArray
from envgen_usd.models.lanes import WALKED
from envgen_usd.models.road_surface import KERB_STONE, Patch
from envgen_usd.opendrive.geometry.lane_borders import section_points
from envgen_usd.opendrive.geometry.section_grids import SectionGrid
from envgen_usd.opendrive.strips.lane_strips import Strip, lane_patch

STONE_WIDTH = 0.15
"""Width of a kerb stone, metres: high kerbs of EN 1340 and DIN 483 are 12, 15 and 18 cm wide."""
LEAST_RISE = 0.03
"""Height above the neighbour from which a sidewalk has kerb stones, metres: German crossings are
lowered to 3 cm."""
_NARROWEST = 2e-3
"""Width of a sidewalk in metres below which it has no stones."""


def kerb_stone_strips(grid: SectionGrid) -> Iterator[Strip]:
    """Yields the kerb stones of a section, laid onto its sidewalks beside lower lanes."""
    borders = grid.borders
    for place in range(1, len(borders.lanes)):
        step = borders.height_right[:, place - 1] - borders.height_left[:, place]
        for lane, side, rise in ((place - 1, 1.0, step), (place, -1.0, -step)):
            if borders.lanes[lane].type in WALKED:
                yield from _stones(grid, lane, place, side, rise >= LEAST_RISE)


def stones_of(sidewalk: Patch) -> Patch:
    """The stones at the edges of a sidewalk."""
    return replace(sidewalk, id=f"{sidewalk.id}_{KERB_STONE}", kind=KERB_STONE, material="")


def _stones(
    grid: SectionGrid, lane: int, place: int, side: float, raised: BoolArray
) -> Iterator[Strip]:
    """Strips along a border, on its left (side 1) or right (-1), in the rows that are raised."""
    borders, patch = grid.borders, stones_of(lane_patch(grid, grid.borders.lanes[lane]))
    widths = borders.t[:, lane] - borders.t[:, lane + 1]
    for first, after in zip(*true_runs(raised), strict=True):
        rows = slice(first, after)
        foot = borders.t[rows, place]
        back = foot + side * np.minimum(STONE_WIDTH, widths[rows])
        across = np.sort(np.column_stack([foot, back]))[:, ::-1]
        if after - first < 2 or np.ptp(across, axis=1).max() < _NARROWEST:
            continue
        points = section_points(grid.road, grid.section, borders.s[rows], across)
        level = np.zeros((after - first, 2))
        yield Strip(points[:, 0], points[:, 1], level, level, patch)
