"""Reports ground steeper than the environment's rule, where only a retaining wall would hold."""

from collections.abc import Mapping

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.road_surface import RoadSurface

TOLERANCE = 0.02
"""Metres per metre by which a slope may exceed the rule without a report."""
LEAST_AREA = 4.0
"""Least contiguous area of steep ground in square metres that is reported."""


def find_steep_ground(
    heightmaps: Mapping[Chunk, HeightMap], surface: RoadSurface, rules: TerrainRules
) -> tuple[Issue, ...]:
    """Reports ground beside the road that is steeper than the rule.

    Such ground lies between roads or plots without room for a bank, or in a steep elevation model.

    Args:
        heightmaps: Height maps by chunk.
        surface: The whole road.
        rules: Terrain rules with the steepest slope.

    Returns:
        At most one issue per chunk.
    """
    outline = Outline.of(surface)
    issues = []
    for chunk, heightmap in sorted(heightmaps.items()):
        slopes = np.where(_beside_the_road(chunk, outline), _slopes(heightmap.heights), 0.0)
        steep = _large_parts(slopes > rules.bank_slope + TOLERANCE)
        if steep.any():
            issues.append(_issue(chunk, np.where(steep, slopes, 0.0), rules.bank_slope))
    return tuple(issues)


def _slopes(heights: FloatArray) -> FloatArray:
    """Returns the slope of each cell, 255 x 255, metres per metre."""
    east, north = np.diff(heights, axis=1), np.diff(heights, axis=0)
    east, north = (east[1:] + east[:-1]) / 2, (north[:, 1:] + north[:, :-1]) / 2
    slopes: FloatArray = np.hypot(east, north) / CELL_SIZE
    return slopes


def _beside_the_road(chunk: Chunk, outline: Outline) -> BoolArray:
    """Returns the cells without a corner on the road, 255 x 255."""
    corners = outline.encloses_grid(*chunk.corner_axes())
    either = corners[1:] | corners[:-1]
    beside: BoolArray = ~(either[:, 1:] | either[:, :-1])
    return beside


def _large_parts(cells: BoolArray) -> BoolArray:
    parts, _ = ndimage.label(cells)
    sizes = np.bincount(parts.ravel()) * CELL_SIZE**2
    large: BoolArray = cells & (sizes >= LEAST_AREA)[parts]
    return large


def _issue(chunk: Chunk, slopes: FloatArray, allowed: float) -> Issue:
    row, column = np.unravel_index(int(slopes.argmax()), slopes.shape)
    x, y = (axis[place] for axis, place in zip(chunk.cell_centres(), (column, row), strict=True))
    area = np.count_nonzero(slopes) * CELL_SIZE**2
    return Issue(
        "terrain.steep",
        Severity.WARNING,
        f"chunk {chunk.name}",
        f"{area:.0f} m² of ground are steeper than {allowed:g} m per m, up to "
        f"{slopes.max():.1f} at ({x:.1f}, {y:.1f})",
        "built at that slope; a retaining wall would be needed",
    )
