"""Ground that is steeper than the environment allows: where only a wall would hold it."""

from collections.abc import Mapping

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.outline import Outline
from envgen_usd.models.arrays import BoolArray, FloatArray
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface

TOLERANCE = 0.02
"""Metres a metre by which a slope may exceed the rule before it is one to report."""
LEAST_AREA = 4.0
"""Square metres of steep ground that lie together before they are reported."""


def find_steep_ground(
    heightmaps: Mapping[Chunk, HeightMap], surface: RoadSurface, rules: TerrainRules
) -> tuple[Issue, ...]:
    """Finds ground beside the road that rises faster than the rule allows.

    It lies between roads, or between roads and plots, whose heights leave no room for a bank; or
    it is as steep in a real terrain.

    Args:
        heightmaps: Ground of chunks.
        surface: The whole road.
        rules: The steepest slope.

    Returns:
        At most one issue a chunk.
    """
    outline = Outline.of(surface)
    issues = []
    for chunk, made in sorted(heightmaps.items()):
        slopes = np.where(_beside_the_road(chunk, outline), _slopes(made.heights), 0.0)
        steep = _large_parts(slopes > rules.bank_slope + TOLERANCE)
        if steep.any():
            issues.append(_issue(chunk, np.where(steep, slopes, 0.0), rules.bank_slope))
    return tuple(issues)


def _slopes(heights: FloatArray) -> FloatArray:
    """Slope of each cell, 255 x 255, metres a metre."""
    east, north = np.diff(heights, axis=1), np.diff(heights, axis=0)
    east, north = (east[1:] + east[:-1]) / 2, (north[:, 1:] + north[:, :-1]) / 2
    slopes: FloatArray = np.hypot(east, north) / CELL_SIZE
    return slopes


def _beside_the_road(chunk: Chunk, outline: Outline) -> BoolArray:
    """Cells that have no corner on the road, 255 x 255."""
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
        f"{area:.0f} m² of ground are steeper than {allowed:g} m a metre, up to "
        f"{slopes.max():.1f} at ({x:.1f}, {y:.1f})",
        "built as steep as they are; a retaining wall would be needed",
    )
