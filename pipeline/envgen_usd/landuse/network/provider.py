"""The learned source of landuse: chunk by chunk, each seeing what its neighbours have fixed."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.outline import Outline
from envgen_usd.landuse.network.checkpoint import read_network
from envgen_usd.landuse.network.classes import ROAD
from envgen_usd.landuse.network.conditions import CONDITIONS, describe
from envgen_usd.landuse.network.fields import StreetIndex, expand, raw_fields
from envgen_usd.landuse.network.generator import Generator, PlainUNet
from envgen_usd.landuse.network.rasters import street_free
from envgen_usd.landuse.network.repair import repair
from envgen_usd.landuse.network.samples import Scene, fields_index
from envgen_usd.landuse.network.sampling import UNSEEN, Chance, draw_chance, fill, schedule
from envgen_usd.landuse.network.windows import SIDE, gather, inner, lattice, mosaic, tile
from envgen_usd.models.arrays import BoolArray, ByteArray
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface
from envgen_usd.seeds import generator

BATCH = 4
"""Chunks that are generated at once."""
_SHAPE = (LANDUSE_CELLS, LANDUSE_CELLS)


class NetworkProvider:
    """Landuse by a trained network.

    What is asked for along each street is drawn from the environment's ranges for the whole map,
    and so is the noise of woods; the network draws the map that follows. Masked diffusion is told
    nothing but the noise of woods and draws the rest itself. Chunks are generated in
    four rounds, as on a checkerboard of two by two, so chunks of a round do not touch and the
    order within it does not matter. As neighbours are seen, a chunk depends on which of its
    neighbours are asked for with it.
    """

    def __init__(self, weights: Path) -> None:
        """Reads the weights that `train` made.

        Raises:
            EnvgenError: They cannot be read.
        """
        self._network = read_network(weights, "landuse")

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
        scene = Scene(surface, profile, "", told=network.config.passes == 1)
        self._index: StreetIndex = fields_index(scene, seed)
        self._outline = Outline.of(surface)
        self._streets = network.config.streets
        condition = describe(profile) if self._streets else np.zeros(CONDITIONS, dtype=np.float32)
        self._condition = torch.from_numpy(condition)

    def add(self, chunks: Sequence[Chunk]) -> None:
        """Generates chunks that do not touch one another."""
        channels = np.stack([self._known(chunk) for chunk in chunks])
        fields = expand(torch.from_numpy(np.stack([self._fields(chunk) for chunk in chunks])))
        condition = self._condition.expand(len(chunks), -1)
        filled = fill(self._network, channels, fields, condition, self._chance(chunks))
        for chunk, window in zip(chunks, filled, strict=True):
            self.done[chunk] = inner(window)

    def _chance(self, chunks: Sequence[Chunk]) -> Chance:
        """One style for the whole map; what is drawn cell by cell follows from the chunk."""
        passes = schedule(self._network.config.passes)
        rngs = [generator(self._seed, "landuse", "passes", chunk.x, chunk.y) for chunk in chunks]
        style = int(generator(self._seed, "landuse", "style").integers(2**31))
        return replace(draw_chance(rngs, (SIDE, SIDE), passes), seeds=[style] * len(chunks))

    def _fields(self, chunk: Chunk) -> NDArray[np.float16]:
        raw = raw_fields(self._index, *lattice(chunk, 2))
        return raw if self._streets else street_free(raw)

    def _known(self, chunk: Chunk) -> ByteArray:
        """Fixed channels of a window: those of finished neighbours, and the road."""
        nothing = np.full(_SHAPE, UNSEEN, dtype=np.uint8)
        channels: ByteArray = gather(chunk, lambda c: self.done.get(c, nothing))
        road: BoolArray = self._outline.encloses_grid(*lattice(chunk, 1))
        return np.where(road, np.uint8(ROAD), channels)
