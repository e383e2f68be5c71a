"""Land by a network: heights of a whole map from the course of its roads."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from envgen_usd.chunks import Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HEIGHT_CELLS, HeightSample
from envgen_usd.landuse.network.heights.height_filling import fill_heights
from envgen_usd.landuse.network.heights.height_scenes import (
    Terrain,
    describe_terrain,
    height_raw,
    on_grid,
    road_cells,
)
from envgen_usd.landuse.network.training.weights_file import read_network
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.ground import Heights
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

BATCH = 4
"""Number of windows per batch; a larger value uses more memory."""
_HALO = HEIGHT_CELLS // 2
"""Margin of a window around its chunk, cells of heights; adjacent windows blend over twice that."""
_SIDE = HEIGHT_CELLS + 2 * _HALO
"""Side of a window, cells of heights: that of training windows."""


@dataclass(frozen=True)
class NetworkLand:
    """Land of a network, queried for heights like an elevation model.

    Attributes:
        reference: The ground interpolated from the road alone.
        rise: H x W cells of heights, metres above the reference.
        first: Column and row of the first cell, counted from the origin of the road frame.
    """

    reference: Heights
    rise: FloatArray
    first: IntArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights at points (N x 2), metres; outside the map those of the reference."""
        column, row = (points[:, :2] / HEIGHT_CELL - 0.5 - self.first).T
        rise = ndimage.map_coordinates(self.rise, [row, column], order=3, mode="constant")
        heights: FloatArray = self.reference(points) + rise
        return heights


class HeightNetwork:
    """Generates land by a network trained on heights."""

    def __init__(self, weights: Path) -> None:
        """Reads the weights of a training run.

        Raises:
            EnvgenError: The weights cannot be read, or belong to another target.
        """
        self._network = read_network(weights, "height")

    def land(
        self,
        surface: RoadSurface,
        chunks: Sequence[Chunk],
        rules: TerrainRules,
        terrain: Terrain,
        seed: int,
    ) -> NetworkLand:
        """Generates the land of chunks.

        A window around each chunk is generated independently, and overlapping windows are blended.
        So there are no seams, and the order of chunks does not matter.

        Args:
            surface: The whole road.
            chunks: Tiles.
            rules: Relief and banks.
            terrain: Interpolates the ground from the road.
            seed: The user's seed.
        """
        reference, outline = terrain(surface, rules, None), Outline.of(surface)
        style = int(generator(seed, "heights", "style").integers(2**31))
        places = np.array([(chunk.x, chunk.y) for chunk in chunks])
        first = places.min(axis=0) * HEIGHT_CELLS - _HALO
        columns, rows = (np.ptp(places, axis=0) * HEIGHT_CELLS + _SIDE).tolist()
        rise, weight = np.zeros((2, rows, columns))
        ordered = sorted(chunks)  # sums of floats depend on their order
        for start in range(0, len(ordered), BATCH):
            part = ordered[start : start + BATCH]
            windows = [_window(chunk, reference, outline, rules) for chunk in part]
            generated = fill_heights(self._network, windows, [style] * len(part))
            for chunk, window in zip(part, generated, strict=True):
                column, row = np.array([chunk.x, chunk.y]) * HEIGHT_CELLS - _HALO - first
                cells = np.s_[row : row + _SIDE, column : column + _SIDE]
                rise[cells] += _fading() * window
                weight[cells] += _fading()
        # At a corner of the map, a window has a quarter of its weight at its chunk's corner.
        return NetworkLand(reference, rise / np.maximum(weight, 0.25), first)


def _window(
    chunk: Chunk, reference: Heights, outline: Outline, rules: TerrainRules
) -> HeightSample:
    """Known data of a chunk's window."""
    offsets = (np.arange(_SIDE, dtype=np.float64) + 0.5 - _HALO) * HEIGHT_CELL
    x, y = (origin + offsets for origin in chunk.origin)
    ground = on_grid(reference, x, y)
    raw, road = height_raw(outline, ground, x, y), road_cells(outline, x, y)
    nothing = np.zeros(ground.shape, dtype=np.float32)
    return HeightSample(raw, describe_terrain(rules), ground.astype(np.float32), nothing, road)


def _fading() -> NDArray[np.float64]:
    """Blending weights of a window's cells, `_SIDE`²; those of adjacent windows add up to 1."""
    ramp = np.minimum((np.arange(_SIDE) + 0.5) / HEIGHT_CELLS, 1.0)
    weights = ramp * ramp[::-1]
    return np.outer(weights, weights)
