"""Land by a network: heights of a whole map from the course of its roads."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy import ndimage

from envgen_usd.chunks import Chunk
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HEIGHT_CELLS, HeightSample
from envgen_usd.landuse.network.heights.height_filling import fill_heights
from envgen_usd.landuse.network.heights.height_scenes import (
    SQUARE,
    RoadGround,
    ground_beside,
    road_cells,
)
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
        places = np.clip([row, column], 0.0, np.array(self.heights.shape)[:, None] - 1.0)
        heights: FloatArray = ndimage.map_coordinates(
            self._spline, places, order=3, mode="mirror", prefilter=False
        )
        return heights

    @cached_property
    def _spline(self) -> FloatArray:
        """Coefficients of the spline, for all calls."""
        coefficients: FloatArray = ndimage.spline_filter(self.heights, order=3, mode="mirror")
        return coefficients


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
        size = np.ptp(places, axis=0) * HEIGHT_CELLS + SQUARE
        steps = (np.arange(count, dtype=np.float64) + 0.5 for count in size.tolist())
        x, y = ((start + axis) * HEIGHT_CELL for start, axis in zip(first, steps, strict=True))
        roads = road_cells(surface, x, y)
        total, weight = np.zeros((2, *roads.road.shape))
        fading = _fading()
        ordered = sorted(chunks)  # sums of floats depend on their order
        for start in range(0, len(ordered), BATCH):
            cuts = [_window(chunk, first) for chunk in ordered[start : start + BATCH]]
            windows = [_sample(ground_beside(roads.part(*cut))) for cut in cuts]
            generated = fill_heights(self._network, windows, [style] * len(windows))
            for cut, window, rise in zip(cuts, windows, generated, strict=True):
                total[cut] += fading * (window.reference + rise)
                weight[cut] += fading
        away = weight == 0.0
        heights = np.where(away, total.sum() / weight.sum(), total / np.where(away, 1.0, weight))
        return GridLand(heights, first)


def _window(chunk: Chunk, first: IntArray) -> tuple[slice, slice]:
    """Rows and columns of a chunk's window."""
    column, row = (np.array([chunk.x, chunk.y]) * HEIGHT_CELLS - _HALO - first).tolist()
    return slice(row, row + SQUARE), slice(column, column + SQUARE)


def _sample(told: RoadGround) -> HeightSample:
    """A window whose ground is not known."""
    nothing = np.zeros(told.road.shape, dtype=np.float32)
    reference = told.reference.astype(np.float32)
    return HeightSample(told.raw, told.condition, reference, nothing, told.road)


def _fading() -> FloatArray:
    """Weights of a window's cells, `SQUARE`²: 1 in the middle, hardly any at the border."""
    ramp = 1.0 - np.abs(np.arange(SQUARE) - (SQUARE - 1) / 2.0) / (SQUARE / 2.0)
    weights: FloatArray = np.outer(ramp, ramp)
    return weights
