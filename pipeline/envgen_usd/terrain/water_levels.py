"""Lays water below the land at its banks and quays."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk, snap
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.ground import HeightMap, Water
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.terrain.chunk_surroundings import with_surroundings
from envgen_usd.terrain.water_bodies import WaterBodies

QUAYED = 0.2
"""Share of a body's border that makes it a harbour; a pier of a lake is less."""
LAKE_RISE = 2.0
"""Metres by which the banks of level water may differ; those of a river differ by more."""
DOCK_RISE = 6.0
"""The same between quays, metres."""
BED = 12
"""Half of the side of the square whose lowest land a river follows, cells; a larger value gives a
more even slope."""
SHORE = 12.0
"""Distance from the water up to which banks slope, metres; they fade in over half of it."""
NEAR = 3
"""Distance from the water up to which its level is told, cells."""
_MARGIN = 64
_NO_CHUNK = 255
_FIRM = (
    LanduseClass.ROAD,
    LanduseClass.QUAY,
    LanduseClass.RUBBLE,
    LanduseClass.SQUARE,
    LanduseClass.PARKING,
    LanduseClass.ACCESS,
    LanduseClass.ROAD_END,
    LanduseClass.RAIL,
)
"""Classes whose ground does not slope to the water: it ends at a wall."""


def lower_water(
    heightmaps: Mapping[Chunk, HeightMap],
    maps: Mapping[Chunk, LanduseMap],
    rules: TerrainRules,
    wanted: Collection[Chunk] | None = None,
) -> dict[Chunk, HeightMap]:
    """Returns height maps whose water lies below the land.

    1. A connected body is level: `bank_height` below the lowest land at its border, or
       `quay_height`, if `QUAYED` of its border is quay.
    2. A river, whose banks differ by more than `LAKE_RISE`, lies `bank_height` below the lowest
       land around each place.
    3. Banks slope to the water by `bank_slope` at most. Paved ground and railways stay as they
       are, and so does the land beside them as far as a slope needs; there, the height at the
       water's border is that of the land, and a wall leads down.

    Args:
        heightmaps: Heights of the land, also where there is water.
        maps: Landuse of the same chunks.
        rules: Heights above the water, and slopes.
        wanted: Chunks to return; `None` means all. Bodies have to lie within the chunks given.
    """
    chunks = sorted(heightmaps if wanted is None else wanted)
    wet = {c for c in maps if (maps[c].classes == LanduseClass.WATER).any()}
    if not wet:
        return {chunk: heightmaps[chunk] for chunk in chunks}
    bodies = WaterBodies.of(maps, heightmaps)
    is_dock = bodies.quays >= QUAYED
    rise = np.where(is_dock, DOCK_RISE, LAKE_RISE)
    drop = np.where(is_dock, rules.quay_height, rules.bank_height)
    is_level = bodies.highest - bodies.lowest <= rise
    levels = np.where(is_level, snap(bodies.lowest - drop), np.nan)
    return {
        chunk: _lowered(chunk, heightmaps, maps, bodies.cells, levels, rules)
        if chunk in wet or wet & set(chunk.neighbours())
        else heightmaps[chunk]
        for chunk in chunks
    }


def _lowered(  # noqa: PLR0913, PLR0917 - land, water and rules
    chunk: Chunk,
    heightmaps: Mapping[Chunk, HeightMap],
    maps: Mapping[Chunk, LanduseMap],
    cells: Mapping[Chunk, IntArray],
    levels: FloatArray,
    rules: TerrainRules,
) -> HeightMap:
    """Height map of a chunk with the water in and beside it."""
    classes = with_surroundings(
        chunk, lambda near: maps[near].classes if near in maps else None, _MARGIN, _NO_CHUNK
    )
    water = classes == LanduseClass.WATER
    if not water.any():
        return heightmaps[chunk]
    dry = np.full((LANDUSE_CELLS, LANDUSE_CELLS), -1)
    body = with_surroundings(
        chunk, lambda near: cells.get(near, dry) if near in maps else None, _MARGIN, -1
    )
    land = with_surroundings(
        chunk,
        lambda near: heightmaps[near].heights if near in heightmaps else None,
        _MARGIN,
        np.nan,
    )
    level = _at_corners(np.where(body < 0, np.nan, levels[body]))
    wet, river = _any_corner(water), _any_corner(water & np.isnan(levels[body]))
    if river.any():
        level = np.where(river, snap(_lowest_around(land) - rules.bank_height), level)
    away, nearest = ndimage.distance_transform_edt(~wet, return_indices=True)
    away *= CELL_SIZE
    near_level = level[nearest[0], nearest[1]]
    solid = _any_corner(np.isin(classes, _FIRM))
    free = ndimage.distance_transform_edt(~solid) * CELL_SIZE if solid.any() else np.inf
    sloped = np.minimum(land, near_level + rules.bank_slope * away)
    sloped = np.maximum(sloped, land - rules.bank_slope * np.maximum(free - CELL_SIZE, 0.0))
    share = np.clip(2.0 * (1.0 - away / SHORE), 0.0, 1.0)
    heights = np.where(
        share > 0.0, share * np.maximum(sloped, near_level) + (1.0 - share) * land, land
    )
    inside = wet & ~_any_corner(~water & (classes != _NO_CHUNK))
    heights = np.where(inside, near_level, heights)
    told = np.where(away <= NEAR * CELL_SIZE, near_level, np.nan)
    own = slice(_MARGIN, -_MARGIN)
    sides = ((0, -1), (0, 1), (-1, 0), (1, 0))
    known = np.array([Chunk(chunk.x + x, chunk.y + y) in maps for x, y in sides])
    of_chunk = Water(told[own, own], _beyond(water), known)
    return replace(heightmaps[chunk], heights=heights[own, own], water=of_chunk)


def _beyond(water: BoolArray) -> BoolArray:
    """Which cells next to the chunk's borders are water: south, north, west and east of it."""
    own, first, last = slice(_MARGIN, -_MARGIN), _MARGIN - 1, -_MARGIN
    return np.stack([water[first, own], water[last, own], water[own, first], water[own, last]])


def _any_corner(cells: BoolArray) -> BoolArray:
    """Which corners belong to a cell of a set, (N + 1) x (N + 1) for N x N."""
    padded = np.pad(cells, 1)
    found: BoolArray = padded[1:, 1:] | padded[1:, :-1] | padded[:-1, 1:] | padded[:-1, :-1]
    return found


def _at_corners(values: FloatArray) -> FloatArray:
    """Least value of the cells at each corner, (N + 1) x (N + 1) for N x N; NaN without any."""
    padded = np.pad(values, 1, constant_values=np.nan)
    found: FloatArray = np.fmin(
        np.fmin(padded[1:, 1:], padded[1:, :-1]), np.fmin(padded[:-1, 1:], padded[:-1, :-1])
    )
    return found


def _lowest_around(land: FloatArray) -> FloatArray:
    """Mean of the lowest land around the places within `BED`: never above the land itself."""
    known = ~np.isnan(land)
    size = 2 * BED + 1
    lowest = ndimage.minimum_filter(
        np.where(known, land, np.inf), size, mode="constant", cval=np.inf
    )
    # Sums of single weights, not running ones, are equal in the windows of all chunks.
    total, count = (
        ndimage.correlate1d(
            ndimage.correlate1d(each, np.ones(size), axis=0, mode="constant"),
            np.ones(size),
            axis=1,
            mode="constant",
        )
        for each in (np.where(known, lowest, 0.0), known.astype(np.float64))
    )
    mean: FloatArray = total / np.maximum(count, 1.0)
    return mean
