"""Plots around houses where no parcels are known: the Voronoi cells of houses within a block.

1. A cell belongs to the nearest house of its own block, within the reach of the house.
2. A block is land that roads, water and railways separate from other land.
"""

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.models.landuse import LanduseClass

TERRITORY = 25.0
"""Farthest land that may belong to a house, metres from its walls."""
YARD = 50.0
"""The same for halls, whose yards are larger, metres."""
MARGIN = 80
"""Cells around a map that decide about its plots; more than `YARD` and half a house."""
BARRIERS = (LanduseClass.ROAD, LanduseClass.WATER, LanduseClass.RAIL)
"""Classes that separate blocks."""


def territories(houses: IntArray, classes: ByteArray, reach: FloatArray) -> IntArray:
    """Number of the nearest house of each cell's block; 0 out of reach, and on barriers.

    Args:
        houses: H x W, number of the house on each cell, 0 without.
        classes: H x W, `LanduseClass` values.
        reach: Farthest land of each house by number, metres; entry 0 is not used.
    """
    houses = np.where(np.isin(classes, BARRIERS), 0, houses)
    if not houses.any():
        return np.zeros_like(houses)
    blocks = np.asarray(ndimage.label(~np.isin(classes, BARRIERS))[0], np.int64)
    distance, index = ndimage.distance_transform_edt(houses == 0, return_indices=True)
    near = houses[tuple(index)]
    far = reach.max() / CELL_SIZE
    inside = (blocks > 0) & (distance <= far)
    elsewhere = inside & (blocks[tuple(index)] != blocks)
    distance, near = _in_own_block(houses, blocks, elsewhere, (distance, near), far)
    return np.where(inside & (distance * CELL_SIZE <= reach[near]), near, 0)


def separate(houses: IntArray) -> BoolArray:
    """Cells of houses without those that touch another house: components are single houses."""
    inside = houses > 0
    padded = np.pad(houses, 1)
    for rows, columns in ((slice(2, None), slice(1, -1)), (slice(1, -1), slice(2, None))):
        other = padded[rows, columns]
        inside &= (other == houses) | (other == 0)
    return inside


def _in_own_block(
    houses: IntArray,
    blocks: IntArray,
    cells: BoolArray,
    nearest: tuple[FloatArray, IntArray],
    far: float,
) -> tuple[FloatArray, IntArray]:
    """Distance and number of the nearest house, looked up again for cells by their block."""
    distance, near = nearest
    row, column = np.nonzero(cells)
    # Inner cells of a house are never nearest, and the third coordinate keeps blocks apart.
    walls = (houses > 0) & (ndimage.minimum_filter(houses, 3) != houses)
    wall_row, wall_column = np.nonzero(walls & (blocks > 0))
    if not len(row) or not len(wall_row):
        return np.where(cells, np.inf, distance), near
    apart = 4.0 * far
    tree = cKDTree(np.column_stack([wall_row, wall_column, blocks[wall_row, wall_column] * apart]))
    places = np.column_stack([row, column, blocks[row, column] * apart])
    hits = tree.query(places, distance_upper_bound=far)
    away, wall = np.asarray(hits[0]), np.asarray(hits[1])
    found = np.isfinite(away)
    distance, near = distance.copy(), near.copy()
    distance[row, column] = away
    wall = wall[found]
    near[row[found], column[found]] = houses[wall_row[wall], wall_column[wall]]
    return distance, near
