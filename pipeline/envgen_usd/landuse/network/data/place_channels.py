"""Channels of networks that learn real places: classes, and main buildings on their plots.

Plots need no channel: they follow from the buildings (`plot_territories`), so none is ragged.
A building has two channels, so that two beside each other stay apart: its core, and what is around.
"""

import numpy as np
from scipy import ndimage

from envgen_usd.models.array_types import BoolArray, ByteArray
from envgen_usd.models.landuse import LanduseClass

GIVEN = (LanduseClass.ROAD, LanduseClass.WATER, LanduseClass.RAIL)
"""Classes that are given and never generated, the first channels."""
CHOSEN = (
    LanduseClass.GRASS,
    LanduseClass.VERGE,
    LanduseClass.LAWN,
    LanduseClass.RUBBLE,
    LanduseClass.ACCESS,
    LanduseClass.WOOD,
    LanduseClass.PARK,
    LanduseClass.PARKING,
    LanduseClass.ALLOTMENT,
    LanduseClass.FIELD,
)
"""Classes that a network chooses, the next channels."""
PLACE_CLASSES = (*GIVEN, *CHOSEN)
HOUSE = len(PLACE_CLASSES)
"""Channel of a main building on residential ground, outside its core."""
HALL = HOUSE + 1
"""The same on industrial ground."""
CORE = HALL + 1
"""Channel of a building's core: cells at least half as far from its walls as its middle is."""
PLACE_INPUTS = CORE + 1
"""Number of input channels."""
PLACE_OUTPUTS = PLACE_INPUTS - len(GIVEN)
"""Number of output channels: all except those of `GIVEN`."""

_CHANNEL = np.full(max(LanduseClass) + 1, PLACE_CLASSES.index(LanduseClass.GRASS), np.uint8)
_CHANNEL[list(PLACE_CLASSES)] = np.arange(HOUSE)
_CHANNEL[LanduseClass.ROAD_END] = PLACE_CLASSES.index(LanduseClass.ACCESS)
_CHANNEL[[LanduseClass.CROP, LanduseClass.ORCHARD]] = PLACE_CLASSES.index(LanduseClass.FIELD)
_CHANNEL[[LanduseClass.SQUARE, LanduseClass.QUAY]] = PLACE_CLASSES.index(LanduseClass.PARKING)
_ON_BUILDINGS = (LanduseClass.LAWN, LanduseClass.RUBBLE, LanduseClass.LAWN)
_CLASS = np.array([*PLACE_CLASSES, *_ON_BUILDINGS], np.uint8)


def to_place_channels(classes: ByteArray, built: BoolArray) -> ByteArray:
    """Channel of each cell.

    Args:
        classes: `LanduseClass` values.
        built: True on main buildings, each a connected part.
    """
    built = built & ~np.isin(classes, GIVEN)
    houses = np.where(classes == LanduseClass.RUBBLE, HALL, HOUSE)
    houses[_cores(built)] = CORE
    channels: ByteArray = np.where(built, houses, _CHANNEL[classes]).astype(np.uint8)
    return channels


def _cores(built: BoolArray) -> BoolArray:
    """Cells of each connected part at least half as far from its edge as the farthest."""
    parts, count = ndimage.label(built)
    if not count:
        return built
    # The edge of the map is no wall.
    inside = ndimage.distance_transform_edt(np.pad(built, 1, mode="edge"))[1:-1, 1:-1]
    middle = np.concatenate([[np.inf], ndimage.maximum(inside, parts, np.arange(1, count + 1))])
    cores: BoolArray = 2.0 * inside > middle[parts]
    return cores


def of_place_channels(channels: ByteArray) -> tuple[ByteArray, BoolArray]:
    """Class of each cell, and true on main buildings."""
    return _CLASS[channels], channels >= HOUSE
