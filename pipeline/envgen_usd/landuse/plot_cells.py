"""The cells of all plots of a map, across chunk borders."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import ByteArray, IntArray
from envgen_usd.models.landuse import LanduseMap


@dataclass(frozen=True)
class _Part:
    """A plot's cells in a chunk.

    Attributes:
        landuse: The chunk.
        cells: N, places in its rasters, row by row, ascending.
    """

    landuse: LanduseMap
    cells: NDArray[np.uint16]


class PlotCells:
    """Cells of plots, on a common grid over the whole map."""

    def __init__(self, maps: Mapping[Chunk, LanduseMap]) -> None:
        """Sorts the cells of each chunk by plot."""
        parts: dict[int, list[_Part]] = {}
        for _, landuse in sorted(maps.items()):
            plots = landuse.plots.ravel()
            order = np.argsort(plots, kind="stable").astype(np.uint16)
            numbers, first = np.unique(plots[order], return_index=True)
            ends = np.append(first, len(order)).tolist()
            for number, start, end in zip(numbers.tolist(), ends[:-1], ends[1:], strict=True):
                if number:
                    parts.setdefault(number, []).append(_Part(landuse, order[start:end]))
        self._parts = parts

    def plots(self, least: int) -> frozenset[int]:
        """Numbers of the plots with a number of cells at least."""
        sizes = ((number, sum(len(p.cells) for p in own)) for number, own in self._parts.items())
        return frozenset(number for number, size in sizes if size >= least)

    def places(self, number: int) -> IntArray:
        """Cells of a plot as (column, row), N x 2; (0, 0) is the first cell of chunk (0, 0)."""
        places = []
        for part in self._parts[number]:
            row, column = np.divmod(part.cells.astype(np.int64), LANDUSE_CELLS)
            chunk = part.landuse.chunk
            first = np.array([chunk.x, chunk.y]) * LANDUSE_CELLS
            places.append(np.stack([column, row], axis=1) + first)
        return np.concatenate(places)

    def classes(self, number: int) -> ByteArray:
        """`LanduseClass` values of a plot's cells, N."""
        return np.concatenate([p.landuse.classes.ravel()[p.cells] for p in self._parts[number]])


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
