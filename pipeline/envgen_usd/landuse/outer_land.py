"""Land behind the outermost plots: fields between hedges, and a forest that ends the view."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.landuse.plot_sites import BACK_LANE
from envgen_usd.landuse.woodland import DISTANCE as WOOD_DISTANCE
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import BlockRules
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.seeds import generator

BEHIND = 12.0
"""Width of the land between the outermost plots and the fields, metres."""
LEAST_BEYOND = 25.0
"""Least width of land behind the deepest plots, metres; a larger value builds more land."""
FIELD = 85.0
"""Mean distance between the middles of fields, metres; a larger value gives larger fields."""
HEDGE = 2.6
"""Width of a hedge between fields, metres; a larger value gives more trees."""
_NUMBERS = 1 << 20
_SPREAD = 0.35
"""Largest move of a field's middle, as a share of `FIELD`; a larger value varies fields more."""


def rows_outside(profile: Profile) -> int:
    """Rows of plots outside of the outermost streets that the land beside a road has room for."""
    plots, blocks = profile.plots, profile.blocks
    rows = max(plots.rows, blocks.outer_rows)
    while rows > plots.rows and _width(profile, rows) > CHUNK_SIZE:
        rows -= 1
    return rows


def land_beside(profile: Profile) -> float:
    """Width of the land beside the road that an environment needs, metres, at most a chunk."""
    return min(_width(profile, rows_outside(profile)), CHUNK_SIZE)


def _plots_width(profile: Profile, rows: int) -> float:
    """Distance of the farthest plot's back from its road, metres."""
    plots = profile.plots
    return plots.verge[1] + rows * plots.depth[1] + (rows - plots.rows) * BACK_LANE


def _width(profile: Profile, rows: int) -> float:
    blocks = profile.blocks
    beyond = BEHIND + blocks.field_width + blocks.forest
    if not blocks.field_width + blocks.forest:
        beyond = LEAST_BEYOND
    return _plots_width(profile, rows) + max(beyond, LEAST_BEYOND)


def farthest_land(profile: Profile) -> float:
    """Largest distance from the road that decides about the land, metres."""
    return max(profile.plots.verge[0], WOOD_DISTANCE, _fields_end(profile) + profile.blocks.forest)


def _fields_end(profile: Profile) -> float:
    """Distance from the road at which fields end and the forest begins, metres."""
    blocks = profile.blocks
    if not blocks.field_width + blocks.forest:
        return blocks.field_edge
    far = _plots_width(profile, rows_outside(profile)) + BEHIND + blocks.field_width
    return min(far, land_beside(profile) - blocks.forest)


def outer_land(
    chunk: Chunk, away: FloatArray, profile: Profile, seed: int
) -> Mapping[LanduseClass, BoolArray]:
    """Cells of the land behind the outermost plots, as far as no plot lies there; 255 x 255 each.

    Fields are cells of a Voronoi diagram of a disturbed lattice of the map, so that all chunks
    agree; a share of `PlotRules.wood` of them are woods. Hedges between them are
    `LanduseClass.WOOD`, too, as is the forest. Beyond it, where no camera on a road sees, all is
    grass.

    Args:
        chunk: Tile.
        away: Distance of the cells from the road, 255 x 255, metres.
        profile: The environment.
        seed: The user's seed.
    """
    blocks, far = profile.blocks, _fields_end(profile)
    found: dict[LanduseClass, BoolArray] = {}
    if blocks.field_width > 0.0:
        number, margin = _fields(chunk, seed)
        zone = (away <= far) & (away > blocks.field_edge)
        share = number / _NUMBERS
        found |= _crops(zone & (share < blocks.fields), share, blocks)
        is_wood = (share >= 1.0 - profile.plots.wood) | (margin < HEDGE)
        found[LanduseClass.WOOD] = zone & is_wood
    if blocks.forest > 0.0:
        forest = (away <= far + blocks.forest) & (away > far)
        found[LanduseClass.WOOD] = found.get(LanduseClass.WOOD, False) | forest
    return found


def _crops(
    fields: BoolArray, share: FloatArray, blocks: BlockRules
) -> dict[LanduseClass, BoolArray]:
    """Cells of each crop; the number of a field decides, as it decides that the field is one."""
    crops = blocks.crops or {"field": 1.0}
    weights = np.cumsum(list(crops.values()))
    drawn = np.searchsorted(weights[:-1] / weights[-1] * blocks.fields, share, side="right")
    return {
        LanduseClass[name.upper()]: fields & (drawn == place) for place, name in enumerate(crops)
    }


def _fields(chunk: Chunk, seed: int) -> tuple[IntArray, FloatArray]:
    """Number of the field at each cell, and the distance from its border, metres; 255 x 255."""
    middles, numbers = _middles(chunk, seed)
    x, y = np.meshgrid(*chunk.cell_centres())
    cells = np.stack([x.ravel(), y.ravel()], axis=1)
    away, nearest = (np.asarray(part) for part in cKDTree(middles).query(cells, k=2))
    first, second = middles[nearest[:, 0]], middles[nearest[:, 1]]
    # Distance from the bisector of the two nearest middles.
    apart = np.linalg.norm(second - first, axis=1)
    margin: FloatArray = (away[:, 1] ** 2 - away[:, 0] ** 2) / (2.0 * apart)
    number: IntArray = numbers[nearest[:, 0]]
    return number.reshape(x.shape), margin.reshape(x.shape)


def _middles(chunk: Chunk, seed: int) -> tuple[FloatArray, IntArray]:
    """Middles of the fields in and around a chunk, and their numbers."""
    low = np.floor(np.array(chunk.bounds[:2]) / FIELD).astype(int) - 2
    high = np.ceil(np.array(chunk.bounds[2:]) / FIELD).astype(int) + 2
    places, numbers = [], []
    for column in range(low[0], high[0] + 1):
        for row in range(low[1], high[1] + 1):
            draw = generator(seed, "landuse", "field", column, row)
            places.append(np.array([column, row]) + 0.5 + draw.uniform(-_SPREAD, _SPREAD, 2))
            numbers.append(int(draw.integers(_NUMBERS)))
    return np.array(places) * FIELD, np.array(numbers, np.int64)
