"""Repairs generated channels to clean classes and numbered plots."""

import numpy as np
from scipy import ndimage

from envgen_usd.landuse.network.data.class_channels import BORDER, INPUT, ROAD, to_classes
from envgen_usd.models.array_types import BoolArray, ByteArray, IntArray
from envgen_usd.models.landuse import LanduseClass

LEAST_CELLS = 12
"""Least number of connected cells of a class; a larger value removes larger specks."""
LEAST_WAY = 4
"""Least number of connected cells of paved ways, which are narrow."""
LEAST_PLOT = 60
"""Least size of a plot, cells: about 37 m². A larger value drops more plots."""
CORE = 1.5
"""Distance from a plot's edge to its core, cells.

Border gaps narrower than twice this value do not join the cores of two plots.
"""
NEAR = 2
"""Largest distance of a paved way from its plot, cells; a larger value keeps more plots."""
ACCESS = INPUT.index(LanduseClass.ACCESS)
"""Channel of paved ways."""
PLOTS = (INPUT.index(LanduseClass.LAWN), INPUT.index(LanduseClass.RUBBLE))
"""Channels of plots."""


def repair(channels: ByteArray) -> tuple[ByteArray, IntArray]:
    """Removes specks, closes border lines and numbers plots.

    1. Connected components below `LEAST_CELLS` (paved ways: `LEAST_WAY`) take the nearest channel;
       border lines are thin and stay.
    2. Cores of plots are numbered, and every cell of a plot takes the number of the nearest core.
    3. Plots that are too small, or without a paved way, become grass.
    4. Border cells take class and plot of the nearest plot, or of the nearest other cell.

    Args:
        channels: H x W; cells of the road are not changed.

    Returns:
        `LanduseClass` values and plot numbers, both H x W.
    """
    channels = _take_nearest(channels, _specks(channels))  # rule 1
    plots = _number(channels)  # rule 2
    counts = np.bincount(plots.ravel())
    lost = (counts < LEAST_PLOT) | ~_reached(channels, plots)  # rule 3
    lost[0] = True
    small = np.isin(channels, PLOTS) & lost[plots]
    channels = np.where(small, np.uint8(INPUT.index(LanduseClass.GRASS)), channels)
    plots = np.where(small, 0, plots)
    border = channels == BORDER  # rule 4
    near = _nearest(~border & (channels != ROAD))
    classes = to_classes(np.where(border, channels[near], channels))
    return classes, np.where(border, plots[near], plots)


def _specks(channels: ByteArray) -> BoolArray:
    specks = np.zeros(channels.shape, dtype=np.bool_)
    for channel in range(1, BORDER):
        labels, _ = ndimage.label(channels == channel)
        least = LEAST_WAY if channel == ACCESS else LEAST_CELLS
        specks |= (np.bincount(labels.ravel()) < least)[labels] & (labels > 0)
    return specks


def _take_nearest(channels: ByteArray, cells: BoolArray) -> ByteArray:
    """Gives cells the channel of the nearest other cell that is neither road nor border."""
    source = ~cells & (channels != ROAD) & (channels != BORDER)
    if not cells.any() or not source.any():
        return channels
    taken: ByteArray = np.where(cells, channels[_nearest(source)], channels)
    return taken


def _number(channels: ByteArray) -> IntArray:
    ground = np.isin(channels, PLOTS)
    cores, count = ndimage.label(ndimage.distance_transform_edt(ground) > CORE)
    if not count:
        return np.zeros(channels.shape, dtype=np.int64)
    numbers: IntArray = cores[_nearest(cores > 0)].astype(np.int64)
    return np.where(ground, numbers, 0)


def _reached(channels: ByteArray, plots: IntArray) -> BoolArray:
    """Plots that touch a paved way or the edge of the map; all plots if there are no paved ways."""
    paved = channels == ACCESS
    count = int(plots.max()) + 1
    if not paved.any():
        return np.ones(count, dtype=np.bool_)
    edge = np.ones(plots.shape, dtype=np.bool_)
    edge[1:-1, 1:-1] = False
    near = plots[edge | ndimage.binary_dilation(paved, iterations=NEAR)]
    return np.bincount(near, minlength=count) > 0


def _nearest(source: BoolArray) -> tuple[IntArray, IntArray]:
    """Row and column of the nearest source cell of every cell."""
    index: IntArray = np.indices(source.shape)
    if source.any():
        index = np.asarray(
            ndimage.distance_transform_edt(~source, return_distances=False, return_indices=True),
            dtype=np.int64,
        )
    return index[0], index[1]
