"""Bodies of water of a map, across its chunks, and the land around them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.terrain.chunk_surroundings import with_surroundings

_TOUCHING = np.ones((3, 3), dtype=bool)
"""Cells that share a corner are one body, since a corner has one level."""
_INSIDE = slice(1, -1)


@dataclass(frozen=True)
class WaterBodies:
    """Connected water of a map; B bodies.

    Attributes:
        cells: Number of the body of each cell of a chunk, 255 x 255; -1 on land.
        lowest: B, height of the lowest land at its border, metres; all of its cells count where no
            border is known.
        highest: B, height of the highest land at its border, metres.
        quays: B, share of its border that is quay.
    """

    cells: Mapping[Chunk, IntArray]
    lowest: FloatArray
    highest: FloatArray
    quays: FloatArray

    @staticmethod
    def of(
        maps: Mapping[Chunk, LanduseMap], heightmaps: Mapping[Chunk, HeightMap]
    ) -> "WaterBodies":
        """Finds the water of chunks; bodies do not reach beyond them.

        Args:
            maps: Landuse.
            heightmaps: Heights of the land, also where there is water.
        """
        cells: dict[Chunk, IntArray] = {}
        count = 0
        for chunk in sorted(maps):
            water = maps[chunk].classes == LanduseClass.WATER
            if water.any():
                labels, found = ndimage.label(water, _TOUCHING)
                cells[chunk] = np.where(water, labels.astype(np.int64) + count - 1, -1)
                count += found
        links = np.array([link for chunk in cells for link in _links(chunk, cells)]).reshape(-1, 2)
        graph = coo_array((np.ones(len(links)), links.T), shape=(count, count))
        number = connected_components(graph, directed=False)[1] if count else np.empty(0, int)
        joined = {c: np.where(part < 0, -1, number[part]) for c, part in cells.items()}
        size = int(number.max(initial=-1)) + 1
        lowest, inside = np.full(size, np.inf), np.full(size, np.inf)
        highest, border, quays = np.full(size, -np.inf), np.zeros(size), np.zeros(size)
        for chunk, part in joined.items():
            classes = with_surroundings(
                chunk, lambda near: maps[near].classes if near in maps else None, 1, _NO_LAND
            )
            land = ~np.isin(classes, (LanduseClass.WATER, _NO_LAND))
            at_land = ndimage.binary_dilation(land, _TOUCHING)[_INSIDE, _INSIDE] & (part >= 0)
            quay = ndimage.binary_dilation(classes == LanduseClass.QUAY, _TOUCHING)
            heights = heightmaps[chunk].heights
            corners = np.stack(
                [
                    heights[y : y + LANDUSE_CELLS, x : x + LANDUSE_CELLS]
                    for y in (0, 1)
                    for x in (0, 1)
                ]
            )
            body = part[at_land]
            np.minimum.at(lowest, body, corners.min(axis=0)[at_land])
            np.maximum.at(highest, body, corners.max(axis=0)[at_land])
            np.minimum.at(inside, part[part >= 0], corners.min(axis=0)[part >= 0])
            border += np.bincount(body, minlength=size)
            quays += np.bincount(part[at_land & quay[_INSIDE, _INSIDE]], minlength=size)
        alone = border == 0.0
        lowest, highest = np.where(alone, inside, lowest), np.where(alone, inside, highest)
        return WaterBodies(joined, lowest, highest, quays / np.maximum(border, 1.0))


_NO_LAND = 255


def _links(chunk: Chunk, cells: Mapping[Chunk, IntArray]) -> Iterator[tuple[int, int]]:
    """Pairs of labels that touch across the northern and the eastern border, and at its corners."""
    around = with_surroundings(chunk, cells.get, 1, -1)
    own = around[_INSIDE, _INSIDE]
    for step in (-1, 0, 1):
        shifted = slice(1 + step, len(around) - 1 + step)
        for mine, other in ((own[-1], around[-1, shifted]), (own[:, -1], around[shifted, -1])):
            both = (mine >= 0) & (other >= 0)
            yield from zip(mine[both].tolist(), other[both].tolist(), strict=True)
