"""The cells of all plots of a map, across chunk borders."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.models.landuse import LanduseMap


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
        count = sum(int(np.count_nonzero(landuse.plots)) for landuse in maps.values())
        places = np.empty((count, 2), np.int64)
        plots, classes = np.empty(count, np.int64), np.empty(count, np.uint8)
        first = 0
        for chunk, landuse in sorted(maps.items()):
            row, column = np.nonzero(landuse.plots)
            own = slice(first, first := first + len(row))
            places[own, 0] = column + chunk.x * LANDUSE_CELLS
            places[own, 1] = row + chunk.y * LANDUSE_CELLS
            plots[own] = landuse.plots[row, column]
            classes[own] = landuse.classes[row, column]
        order = np.argsort(plots, kind="stable")
        return PlotCells(places[order], plots[order], classes[order])

    def spans(self) -> Iterator[tuple[int, slice]]:
        """Plot numbers, ascending, and the range of cells of each plot."""
        numbers, first = np.unique(self.plots, return_index=True)
        ends = np.append(first, len(self.plots)).tolist()
        for number, start, stop in zip(numbers.tolist(), ends[:-1], ends[1:], strict=True):
            yield number, slice(start, stop)


class CellLookup:
    """Looks up the plot and the class of cells by column and row."""

    def __init__(self, maps: Mapping[Chunk, LanduseMap]) -> None:
        """Takes the landuse of chunks."""
        self._maps = maps

    def __call__(self, places: IntArray) -> tuple[IntArray, ByteArray]:
        """Plot numbers and classes of cells (N x 2); both 0 outside plots."""
        plots, classes = np.zeros(len(places), np.int64), np.zeros(len(places), np.uint8)
        tile, local = np.divmod(places, LANDUSE_CELLS)
        for x, y in set(map(tuple, tile.tolist())):
            landuse = self._maps.get(Chunk(x, y))
            if landuse is not None:
                here = np.flatnonzero((tile == (x, y)).all(axis=1))
                column, row = local[here].T
                plots[here] = landuse.plots[row, column]
                classes[here] = landuse.classes[row, column]
        classes[plots == 0] = 0
        return plots, classes
