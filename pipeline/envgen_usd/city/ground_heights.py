"""Height of the ground at any point in and around a chunk."""

from collections.abc import Iterable

import numpy as np

from envgen_usd.chunks import CELL_SIZE, HEIGHT_SAMPLES, Chunk, tiles_of
from envgen_usd.geometry.unique_rows import unique_rows
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.ground import HeightMap


class Ground:
    """Bilinear heights of height maps.

    Attributes:
        chunk: Tile of the chunk; outside all tiles, heights are those of its border.
    """

    def __init__(self, heightmap: HeightMap, neighbours: Iterable[HeightMap] = ()) -> None:
        """Keeps the maps; of duplicate tiles the first counts."""
        self.chunk = heightmap.chunk
        self._maps: dict[Chunk, FloatArray] = {}
        for tile in (heightmap, *neighbours):
            self._maps.setdefault(tile.chunk, tile.heights)

    def heights(self, points: FloatArray) -> FloatArray:
        """Returns the height of the ground, N, metres.

        Args:
            points: N x 2 or N x 3, metres, road frame.
        """
        tiles = tiles_of(points)
        heights = np.empty(len(points))
        for x, y in tiles[unique_rows(tiles)[0]].tolist():
            chosen = (tiles[:, 0] == x) & (tiles[:, 1] == y)
            chunk = Chunk(x, y) if Chunk(x, y) in self._maps else self.chunk
            heights[chosen] = _bilinear(points[chosen, :2], chunk, self._maps[chunk])
        return heights

    def range_under(self, corners: FloatArray) -> tuple[float, float]:
        """Returns the lowest and the highest ground under a parallelogram, metres.

        Args:
            corners: 4 x 2, in order.
        """
        sides = (corners[1] - corners[0], corners[3] - corners[0])
        counts = [int(np.ceil(np.hypot(*side) / CELL_SIZE)) + 1 for side in sides]
        u, v = (np.linspace(0.0, 1.0, max(count, 2)) for count in counts)
        places = corners[0] + u[:, None, None] * sides[0] + v[None, :, None] * sides[1]
        heights = self.heights(places.reshape(-1, 2))
        return float(heights.min()), float(heights.max())


def _bilinear(points: FloatArray, chunk: Chunk, heights: FloatArray) -> FloatArray:
    place = np.clip((points - chunk.origin) / CELL_SIZE, 0.0, HEIGHT_SAMPLES - 1)
    column, row = np.minimum(place.astype(np.int64), HEIGHT_SAMPLES - 2).T
    u, v = (place - np.stack([column, row], axis=1)).T
    low = heights[row, column] * (1 - u) + heights[row, column + 1] * u
    high = heights[row + 1, column] * (1 - u) + heights[row + 1, column + 1] * u
    blended: FloatArray = low * (1 - v) + high * v
    return blended
