"""The cells of all plots of a map, across chunk borders."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.models.landuse import LanduseMap

_BASE = 1 << 31


@dataclass(frozen=True)
class PlotCells:
    """Cells of plots, on a common grid over the whole map.

    Attributes:
        places: C x 2, (column, row); cell (0, 0) is the first of chunk (0, 0). Sorted by plot.
        plots: C, number of the plot, ascending.
        classes: C, `LanduseClass` values.
    """

    places: IntArray
    plots: IntArray
    classes: ByteArray

    @staticmethod
    def of(maps: Mapping[Chunk, LanduseMap]) -> "PlotCells":
        """Collects the cells of all chunks."""
        places, plots, classes = [np.empty((0, 2), np.int64)], [np.empty(0, np.int64)], []
        for chunk, landuse in sorted(maps.items()):
            row, column = np.nonzero(landuse.plots)
            first = np.array([chunk.x, chunk.y]) * LANDUSE_CELLS
            places.append(np.stack([column, row], axis=1) + first)
            plots.append(landuse.plots[row, column])
            classes.append(landuse.classes[row, column])
        all_plots = np.concatenate(plots)
        order = np.argsort(all_plots, kind="stable")
        all_classes = np.concatenate([np.empty(0, np.uint8), *classes])
        return PlotCells(np.concatenate(places)[order], all_plots[order], all_classes[order])

    def spans(self) -> Iterator[tuple[int, slice]]:
        """Plot numbers, ascending, and the range of cells of each plot."""
        numbers, first = np.unique(self.plots, return_index=True)
        ends = np.append(first, len(self.plots)).tolist()
        for number, start, stop in zip(numbers.tolist(), ends[:-1], ends[1:], strict=True):
            yield number, slice(start, stop)


class CellLookup:
    """Looks up the plot and the class of cells by column and row."""

    def __init__(self, cells: PlotCells) -> None:
        """Sorts the cells by column and row."""
        codes = self._codes(cells.places)
        order = np.argsort(codes)
        self._sorted = np.append(codes[order], np.iinfo(np.int64).max)
        self._plots = np.append(cells.plots[order], 0)
        self._classes = np.append(cells.classes[order], np.uint8(0))

    def __call__(self, places: IntArray) -> tuple[IntArray, ByteArray]:
        """Plot numbers and classes of cells (N x 2); both 0 outside plots."""
        codes = self._codes(places)
        index = np.searchsorted(self._sorted, codes)
        hit = self._sorted[index] == codes
        return np.where(hit, self._plots[index], 0), np.where(hit, self._classes[index], 0)

    @staticmethod
    def _codes(places: IntArray) -> IntArray:
        codes: IntArray = places[:, 0] * _BASE + places[:, 1]
        return codes
