"""Land by a network: heights of a whole map from the course of its roads."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import Chunk
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HEIGHT_CELLS, HeightSample
from envgen_usd.landuse.network.heights.height_filling import fill_heights
from envgen_usd.landuse.network.heights.height_scenes import SQUARE, ground_beside
from envgen_usd.landuse.network.training.weights_file import read_network
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

BATCH = 4
"""Number of windows per batch; a larger value uses more memory."""
_HALO = (SQUARE - HEIGHT_CELLS) // 2
"""Margin of a window around its chunk, cells of heights."""


@dataclass(frozen=True)
class GridLand:
    """Land on cells of heights, queried like an elevation model.

    Attributes:
        heights: H x W, metres; row 0 is the south.
        first: Column and row of the first cell, counted from the origin of the road frame.
    """

    heights: FloatArray
    first: IntArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights at points (N x 2), metres, by a cubic spline; outside those of the border."""
        column, row = (points[:, :2] / HEIGHT_CELL - 0.5 - self.first).T
        heights: FloatArray = ndimage.map_coordinates(
            self.heights, [row, column], order=3, mode="nearest"
        )
        return heights


class HeightNetwork:
    """Generates land by a network trained on heights."""

    def __init__(self, weights: Path) -> None:
        """Reads the weights of a training run.

        Raises:
            EnvgenError: The weights cannot be read, or belong to another target.
        """
        self._network = read_network(weights, "height")

    def land(self, surface: RoadSurface, chunks: Sequence[Chunk], seed: int) -> GridLand:
        """Generates the land of chunks.

        A window around each chunk is generated independently, and overlapping windows are blended.
        So there are no seams, and the order of chunks does not matter.

        Args:
            surface: The whole road.
            chunks: Tiles.
            seed: The user's seed.

        Raises:
            EnvgenError: The network's output is not finite.
        """
        style = int(generator(seed, "heights", "style").integers(2**31))
        places = np.array([(chunk.x, chunk.y) for chunk in chunks])
        first = places.min(axis=0) * HEIGHT_CELLS - _HALO
        columns, rows = (np.ptp(places, axis=0) * HEIGHT_CELLS + SQUARE).tolist()
        total, weight = np.zeros((2, rows, columns))
        ordered = sorted(chunks)  # sums of floats depend on their order
        for start in range(0, len(ordered), BATCH):
            part = ordered[start : start + BATCH]
            windows = [_window(chunk, surface) for chunk in part]
            generated = fill_heights(self._network, windows, [style] * len(part))
            for chunk, window, rise in zip(part, windows, generated, strict=True):
                column, row = np.array([chunk.x, chunk.y]) * HEIGHT_CELLS - _HALO - first
                cells = np.s_[row : row + SQUARE, column : column + SQUARE]
                total[cells] += _fading() * (window.reference + rise)
                weight[cells] += _fading()
        away = weight == 0.0
        heights = np.where(away, total.sum() / weight.sum(), total / np.where(away, 1.0, weight))
        return GridLand(heights, first)


def _window(chunk: Chunk, surface: RoadSurface) -> HeightSample:
    """Known data of a chunk's window."""
    offsets = (np.arange(SQUARE, dtype=np.float64) + 0.5 - _HALO) * HEIGHT_CELL
    x, y = (origin + offsets for origin in chunk.origin)
    told = ground_beside(surface, x, y)
    nothing = np.zeros(told.road.shape, dtype=np.float32)
    reference = told.reference.astype(np.float32)
    return HeightSample(told.raw, told.condition, reference, nothing, told.road)


def _fading() -> FloatArray:
    """Weights of a window's cells, `SQUARE`²: 1 in the middle, hardly any at the border."""
    ramp = 1.0 - np.abs(np.arange(SQUARE) - (SQUARE - 1) / 2.0) / (SQUARE / 2.0)
    weights: FloatArray = np.outer(ramp, ramp)
    return weights
