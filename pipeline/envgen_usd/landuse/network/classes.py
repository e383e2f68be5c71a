"""Channels of the network: which classes go in and which come out."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.arrays import ByteArray
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
"""Landuse classes in the order of the network's channels; `BORDER` is one more."""
BORDER = len(INPUT)
"""Channel of cells at which another plot begins: it is what keeps neighbouring plots apart."""
INPUTS = len(INPUT) + 1
"""Channels that go in."""
OUTPUTS = INPUTS - 1
"""Channels that come out: all but road, which is given and never generated."""
ROAD = 0
"""Channel of the road."""

_CHANNEL = np.full(max(LanduseClass) + 1, INPUT.index(LanduseClass.GRASS), dtype=np.uint8)
_CHANNEL[list(INPUT)] = np.arange(len(INPUT), dtype=np.uint8)
_CLASS = np.array([*INPUT, LanduseClass.UNKNOWN], dtype=np.uint8)


def to_channels(classes: ByteArray, plots: NDArray[np.integer[Any]]) -> ByteArray:
    """Returns the channel of each cell: its class, or `BORDER` where a plot meets another.

    Both of two neighbouring cells that belong to two plots are marked, so plots that touch are
    separated by a line of two cells, which has no side that is turned to north or south.

    Args:
        classes: H x W `LanduseClass` values; row 0 is the south.
        plots: H x W plot numbers, 0 where there is none.
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
