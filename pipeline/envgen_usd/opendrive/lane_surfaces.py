"""All lanes as strips of triangles, road by road, without joining them: fast, for maps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.arrays import FloatArray, IntArray
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.surface import Patch
from envgen_usd.opendrive.strips import Strip, lane_strips, section_grids


@dataclass(frozen=True)
class LaneSurfaces:
    """Lanes as the file states them; in junctions they overlap.

    Attributes:
        vertices: V x 3, metres, road frame, lane heights included.
        triangles: T x 3, counter-clockwise seen from above.
        triangle_patch: T, index into `patches`.
        patches: One a lane.
    """

    vertices: FloatArray
    triangles: IntArray
    triangle_patch: IntArray
    patches: tuple[Patch, ...]


def lane_surfaces(network: RoadNetwork, tolerance: float = 0.02) -> LaneSurfaces:
    """Triangulates every lane of every road.

    Args:
        network: The roads.
        tolerance: Largest distance in metres between the surface's edges and the road's curves.
    """
    strips = [
        strip
        for road in network.roads.values()
        for grid in section_grids(road, tolerance)
        for strip in lane_strips(grid)
    ]
    index: dict[Patch, int] = {}
    meaning = np.array([index.setdefault(strip.patch, len(index)) for strip in strips], dtype=int)
    rows = np.array([len(strip.left) for strip in strips], dtype=int)
    return LaneSurfaces(
        _vertices(strips), _triangles(rows), np.repeat(meaning, 2 * (rows - 1)), tuple(index)
    )


def _vertices(strips: Sequence[Strip]) -> FloatArray:
    """All left borders, each before its right border, strip by strip."""
    if not strips:
        return np.empty((0, 3))
    sides = np.concatenate([side for strip in strips for side in (strip.left, strip.right)])
    sides[:, 2] += np.concatenate([strip.height.T.ravel() for strip in strips])
    return sides


def _triangles(rows: IntArray) -> IntArray:
    """Two triangles a cell, for strips with so many rows one after the other."""
    cells = rows - 1
    strip = np.repeat(np.arange(len(rows)), cells)
    row = np.arange(len(strip)) - np.repeat(np.cumsum(cells) - cells, cells)
    left = 2 * (np.cumsum(rows) - rows)[strip] + row
    right = left + rows[strip]
    corners = [right, right + 1, left + 1, right, left + 1, left]
    return np.column_stack(corners).reshape(-1, 3)
