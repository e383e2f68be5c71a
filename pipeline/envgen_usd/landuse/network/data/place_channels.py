"""Channels of networks that learn real places: classes, and main buildings on their plots.

Plots need no channel: they follow from the buildings (`plot_territories`), so none is ragged.
"""

import numpy as np

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
"""Channel of the walls' insides of a main building on residential ground."""
HALL = HOUSE + 1
"""The same on industrial ground."""
PLACE_INPUTS = HALL + 1
"""Number of input channels."""
PLACE_OUTPUTS = PLACE_INPUTS - len(GIVEN)
"""Number of output channels: all except those of `GIVEN`."""

_CHANNEL = np.full(max(LanduseClass) + 1, PLACE_CLASSES.index(LanduseClass.GRASS), np.uint8)
_CHANNEL[list(PLACE_CLASSES)] = np.arange(HOUSE)
_CLASS = np.array([*PLACE_CLASSES, LanduseClass.LAWN, LanduseClass.RUBBLE], np.uint8)


def to_place_channels(classes: ByteArray, built: BoolArray) -> ByteArray:
    """Channel of each cell.

    Args:
        classes: `LanduseClass` values.
        built: True on main buildings.
    """
    built = built & ~np.isin(classes, GIVEN)
    houses = np.where(classes == LanduseClass.RUBBLE, HALL, HOUSE)
    channels: ByteArray = np.where(built, houses, _CHANNEL[classes]).astype(np.uint8)
    return channels


def of_place_channels(channels: ByteArray) -> tuple[ByteArray, BoolArray]:
    """Class of each cell, and true on main buildings."""
    return _CLASS[channels], channels >= HOUSE
