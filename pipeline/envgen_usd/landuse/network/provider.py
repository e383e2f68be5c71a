"""The learned source of landuse: chunk by chunk, each seeing what its neighbours have fixed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.outline import Outline
from envgen_usd.landuse.network.checkpoint import read_network
from envgen_usd.landuse.network.classes import ROAD
from envgen_usd.landuse.network.conditions import describe
from envgen_usd.landuse.network.fields import RoadsideIndex, expand, raw_fields
from envgen_usd.landuse.network.generator import Generator, PlainUNet
from envgen_usd.landuse.network.repair import repair
from envgen_usd.landuse.network.samples import fields_index
from envgen_usd.landuse.network.sampling import UNSEEN, Chance, fill, gumbel
from envgen_usd.landuse.network.windows import gather, inner, lattice, mosaic, tile
from envgen_usd.models.arrays import BoolArray, ByteArray
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface
from envgen_usd.seeds import generator

BATCH = 4
"""Chunks that are generated at once."""
_SHAPE = (LANDUSE_CELLS, LANDUSE_CELLS)


class NetworkProvider:
    """Landuse by the mask-aware transformer.

    Chunks are generated in four rounds, as on a checkerboard of two by two, so chunks of a round
    do not touch and the order within it does not matter. Random numbers belong to the map's cells.
    As neighbours are seen, a chunk depends on which of its neighbours are asked for with it.
    """

    def __init__(self, weights: Path) -> None:
        """Reads the weights that `train` made.

        Raises:
            EnvgenError: They cannot be read.
        """
        self._network = read_network(weights)

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`.

        Raises:
            EnvgenError: No road lies outside a junction.
        """
        if all(line.junction or len(line.s) < 2 for line in surface.roads):
            raise EnvgenError("the map has no road outside a junction; use --landuse rules")
        made = _Making(self._network, surface, profile, seed)
        for turn in range(4):
            one = [c for c in sorted(chunks) if (c.x % 2) + 2 * (c.y % 2) == turn]
            for first in range(0, len(one), BATCH):
                made.add(one[first : first + BATCH])
        joined, corner = mosaic(made.done, ROAD)
        classes, plots = repair(joined)
        return {
            chunk: LanduseMap(
                chunk, tile(classes, chunk, corner).copy(), tile(plots, chunk, corner).copy()
            )
            for chunk in chunks
        }


class _Making:
    """A map while its chunks are generated."""

    def __init__(
        self, network: Generator | PlainUNet, surface: RoadSurface, profile: Profile, seed: int
    ) -> None:
        self.done: dict[Chunk, ByteArray] = {}
        self._network, self._seed = network, seed
        self._index: RoadsideIndex = fields_index(surface, profile)
        self._outline = Outline.of(surface)
        self._condition = torch.from_numpy(describe(profile))

    def add(self, chunks: Sequence[Chunk]) -> None:
        """Generates chunks that do not touch one another."""
        seeds = [
            int(generator(self._seed, "landuse", "style", c.name).integers(2**31)) for c in chunks
        ]
        chance = Chance(
            np.stack([gather(chunk, self._order) for chunk in chunks]),
            np.stack([gather(chunk, self._noise) for chunk in chunks]),
            seeds,
        )
        channels = np.stack([self._known(chunk) for chunk in chunks])
        fields = expand(torch.from_numpy(np.stack([self._fields(chunk) for chunk in chunks])))
        condition = self._condition.expand(len(chunks), -1)
        filled = fill(self._network, channels, fields, condition, chance)
        for chunk, window in zip(chunks, filled, strict=True):
            self.done[chunk] = inner(window)

    def _fields(self, chunk: Chunk) -> NDArray[np.float32]:
        return raw_fields(self._index, *lattice(chunk, 2))

    def _known(self, chunk: Chunk) -> ByteArray:
        """Fixed channels of a window: those of finished neighbours, and the road."""
        nothing = np.full(_SHAPE, UNSEEN, dtype=np.uint8)
        channels: ByteArray = gather(chunk, lambda c: self.done.get(c, nothing))
        road: BoolArray = self._outline.encloses_grid(*lattice(chunk, 1))
        return np.where(road, np.uint8(ROAD), channels)

    def _order(self, chunk: Chunk) -> np.ndarray:
        """When a cell is drawn: numbers in [0, 1) that belong to the map's cells."""
        rng = generator(self._seed, "landuse", "order", chunk.name)
        return rng.random(_SHAPE, dtype=np.float32)

    def _noise(self, chunk: Chunk) -> np.ndarray:
        return gumbel(generator(self._seed, "landuse", "noise", chunk.name), _SHAPE)
