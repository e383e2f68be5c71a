"""Channels of the network: its input and output classes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import ByteArray
from envgen_usd.models.landuse import LanduseClass

INPUT = (
    LanduseClass.ROAD,
    LanduseClass.GRASS,
    LanduseClass.VERGE,
    LanduseClass.LAWN,
    LanduseClass.RUBBLE,
    LanduseClass.ACCESS,
    LanduseClass.WOOD,
)
"""Landuse classes in the order of the network's channels; `BORDER` is an additional channel."""
BORDER = len(INPUT)
"""Channel of cells next to another plot; it separates adjacent plots."""
INPUTS = len(INPUT) + 1
"""Number of input channels."""
OUTPUTS = INPUTS - 1
"""Number of output channels: all except road, which is given and never generated."""
ROAD = 0
"""Channel of the road."""

_CHANNEL = np.full(max(LanduseClass) + 1, INPUT.index(LanduseClass.GRASS), dtype=np.uint8)
_CHANNEL[list(INPUT)] = np.arange(len(INPUT), dtype=np.uint8)
_CHANNEL[LanduseClass.ROAD_END] = INPUT.index(LanduseClass.ACCESS)
_CLASS = np.array([*INPUT, LanduseClass.UNKNOWN], dtype=np.uint8)


def to_channels(classes: ByteArray, plots: NDArray[np.integer[Any]]) -> ByteArray:
    """Returns the channel of each cell: its class, or `BORDER` next to another plot.

    Both of two adjacent cells of different plots are marked. The line between plots is two cells
    wide, so it is the same from either side.

    Args:
        classes: H x W `LanduseClass` values; row 0 is the south.
        plots: H x W plot numbers, 0 without a plot.
    """
    channels: ByteArray = _CHANNEL[classes]
    for axis in (0, 1):
        here = np.moveaxis(plots, axis, 0)[1:]
        before = np.moveaxis(plots, axis, 0)[:-1]
        meets = (here != before) & (here > 0) & (before > 0)
        np.moveaxis(channels, axis, 0)[1:][meets] = BORDER
        np.moveaxis(channels, axis, 0)[:-1][meets] = BORDER
    channels[classes == LanduseClass.ROAD] = ROAD
    return channels


def to_classes(channels: ByteArray) -> ByteArray:
    """Returns the landuse class of each channel; `UNKNOWN` for `BORDER`."""
    classes: ByteArray = _CLASS[channels]
    return classes
