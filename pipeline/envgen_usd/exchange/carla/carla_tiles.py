"""Tiles of a map: a single one, or the grid of CARLA's large maps.

CARLA looks for tiles row by row from (0, 0), and ends at the first gap
(`PrepareAssetsForCookingCommandlet.cpp`), so the grid has to be full. The first number grows to the
east. The second grows as Unreal's y falls (`LargeMapManager.cpp`), which is to the north.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE
from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.stage_chunks import ChunkPlace
from envgen_usd.models.array_types import FloatArray

LARGEST = 2000.0
"""Largest side of a tile, metres, that CARLA supports."""


@dataclass(frozen=True)
class Tile:
    """A square of the map, which becomes a file.

    Attributes:
        name: Name of the file, e.g. ``town`` or ``town_Tile_0_1``.
        low: 2, its south-western corner in the world, metres.
        side: Side, metres.
        places: Chunks whose origins lie in it; empty in a gap of the map.
    """

    name: str
    low: tuple[float, float]
    side: float
    places: tuple[ChunkPlace, ...]


def tiles_of(
    name: str, places: Sequence[ChunkPlace], origins: FloatArray, side: float
) -> list[Tile]:
    """The tiles of a map, by rows from the south-west.

    Args:
        name: Name of the map.
        places: N chunks.
        origins: N x 3, their south-western corners, metres.
        side: Largest side of a tile, metres; a map that fits is a single tile.

    Raises:
        EnvgenError: The side is no multiple of a chunk's, or CARLA does not support it.
    """
    if side % CHUNK_SIZE or not 0.0 < side <= LARGEST:
        raise EnvgenError(
            f"--tile-size {side:g}: give a multiple of {CHUNK_SIZE:g} up to {LARGEST:g} metres"
        )
    low = origins[:, :2].min(axis=0)
    # Chunks lie on a grid, but an artist may have moved them by less than a chunk.
    index = np.floor((origins[:, :2] - low + CHUNK_SIZE / 2) / side).astype(int)
    columns, rows = index.max(axis=0) + 1
    single = columns == rows == 1
    tiles = []
    for y in range(rows):
        for x in range(columns):
            inside = np.flatnonzero((index == (x, y)).all(axis=1))
            corner = (float(low[0] + x * side), float(low[1] + y * side))
            title = name if single else f"{name}_Tile_{x}_{y}"
            tiles.append(Tile(title, corner, side, tuple(places[int(k)] for k in inside)))
    return tiles
