"""Land behind the outermost plots: fields between hedges, and a forest that ends the view."""

from collections.abc import Mapping

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE
from envgen_usd.landuse.field_lattice import NUMBERS, FieldCells
from envgen_usd.landuse.plot_sites import BACK_LANE
from envgen_usd.landuse.woodland import DISTANCE as WOOD_DISTANCE
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.land_rules import BlockRules
from envgen_usd.models.landuse import LanduseClass

BEHIND = 12.0
"""Width of the land between the outermost plots and the fields, metres."""
LEAST_BEYOND = 25.0
"""Least width of land behind the deepest plots, metres; a larger value builds more land."""
HEDGE = 2.6
"""Width of a hedge or wall on each side of a border, metres; a larger value gives more trees."""


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


def land_limits(profile: Profile) -> tuple[float, ...]:
    """Distances from the road at which the land changes, metres."""
    far, blocks = _fields_end(profile), profile.blocks
    return profile.plots.verge[0], WOOD_DISTANCE, blocks.field_edge, far, far + blocks.forest


def _fields_end(profile: Profile) -> float:
    """Distance from the road at which fields end and the forest begins, metres."""
    blocks = profile.blocks
    if not blocks.field_width + blocks.forest:
        return blocks.field_edge
    far = _plots_width(profile, rows_outside(profile)) + BEHIND + blocks.field_width
    return min(far, land_beside(profile) - blocks.forest)


def outer_land(
    fields: FieldCells, away: FloatArray, profile: Profile
) -> Mapping[LanduseClass, BoolArray]:
    """Cells of the land behind the outermost plots, as far as no plot lies there; 255 x 255 each.

    A share of `PlotRules.wood` of the fields are woods. Hedges between them are
    `LanduseClass.WOOD`, too, as is the forest. Beyond it, where no camera on a road sees, all is
    grass.

    Args:
        fields: Fields of the chunk.
        away: Distance of the cells from the road, 255 x 255, metres, as `road_distance` gives it
            for `land_limits`.
        profile: The environment.
    """
    blocks, far = profile.blocks, _fields_end(profile)
    found: dict[LanduseClass, BoolArray] = {}
    zone = (away <= far) & (away > blocks.field_edge)
    if blocks.field_width > 0.0 and zone.any():
        share = fields.numbers[fields.own] / NUMBERS
        border = fields.margin < HEDGE
        found |= _crops(zone & (share < blocks.fields), share, blocks)
        found[LanduseClass.WOOD] = zone & (share >= 1.0 - profile.plots.wood)
        if blocks.borders == "wood":
            found[LanduseClass.WOOD] |= zone & border
        else:
            # Walls lie between basins, also where these come after yards.
            found = {kind: cells & ~border for kind, cells in found.items()}
            found[LanduseClass.QUAY] = found.get(LanduseClass.QUAY, False) | (zone & border)
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
