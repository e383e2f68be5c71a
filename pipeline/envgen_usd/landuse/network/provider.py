"""The learned source of landuse: chunk by chunk, each seeing what its neighbours have fixed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.outline import Outline
from envgen_usd.landuse.network.batches import Batch
from envgen_usd.landuse.network.checkpoint import read_network
from envgen_usd.landuse.network.classes import OUTPUTS, ROAD
from envgen_usd.landuse.network.conditions import describe
from envgen_usd.landuse.network.draws import Draws
from envgen_usd.landuse.network.fields import RoadsideIndex, expand, raw_fields
from envgen_usd.landuse.network.generator import Generator, PlainUNet, one_hot
from envgen_usd.landuse.network.repair import repair
from envgen_usd.landuse.network.samples import fields_index
from envgen_usd.landuse.network.windows import gather, inner, lattice, mosaic, tile
from envgen_usd.models.arrays import BoolArray, ByteArray
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface
from envgen_usd.seeds import generator

WEIGHTS = Path(__file__).parent / "small.safetensors"
"""Weights that come with the package."""
PASSES = (0.0005, 0.004, 0.03)
"""Shares of the cells that are drawn and kept, pass by pass, before the rest is filled in.

One pass cannot choose among many right fills; a few drawn cells choose for it (Chang et al. 2022).
"""
BATCH = 4
"""Chunks that are generated at once."""
UNSEEN = 255
"""Mark of a cell that nothing has been generated for."""
_SHAPE = (LANDUSE_CELLS, LANDUSE_CELLS)


class NetworkProvider:
    """Landuse by the mask-aware transformer.

    Chunks are generated in four rounds, as on a checkerboard of two by two, so chunks of a round
    do not touch and the order within it does not matter. Random numbers belong to the map's cells.
    As neighbours are seen, a chunk depends on which of its neighbours are asked for with it.
    """

    def __init__(self, weights: Path = WEIGHTS) -> None:
        """Reads the weights.

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

    @torch.no_grad()
    def add(self, chunks: Sequence[Chunk]) -> None:
        """Generates chunks that do not touch one another."""
        channels = np.stack([self._known(chunk) for chunk in chunks])
        order = np.stack([gather(chunk, self._order) for chunk in chunks])
        noise = np.stack([gather(chunk, self._noise) for chunk in chunks])
        fields = expand(torch.from_numpy(np.stack([self._fields(chunk) for chunk in chunks])))
        condition = self._condition.expand(len(chunks), -1)
        for share in (*PASSES, 1.0):
            logits = self._logits(_batch(channels, fields, condition), chunks)
            if share < 1.0:
                logits = logits.log_softmax(1) + torch.from_numpy(noise)
            chosen = (logits.argmax(1) + 1).numpy().astype(np.uint8)
            hole = (channels == UNSEEN) & (order < share)
            channels = np.where(hole, chosen, channels)
        for chunk, window in zip(chunks, channels, strict=True):
            self.done[chunk] = inner(window)

    def _logits(self, batch: Batch, chunks: Sequence[Chunk]) -> torch.Tensor:
        seeds = [
            int(generator(self._seed, "landuse", "style", c.name).integers(2**31)) for c in chunks
        ]
        fine, _ = self._network(
            batch.known, batch.mask, batch.fields, batch.condition, Draws(seeds)
        )
        return torch.as_tensor(fine)

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
        """Gumbel noise: the largest of log-probability plus noise is a draw of the class."""
        rng = generator(self._seed, "landuse", "noise", chunk.name)
        even = rng.random((OUTPUTS, *_SHAPE), dtype=np.float32)
        gumbel: np.ndarray = -np.log(-np.log(np.clip(even, 1e-6, 1 - 1e-6)))
        return gumbel


def _batch(channels: ByteArray, fields: torch.Tensor, condition: torch.Tensor) -> Batch:
    mask = torch.from_numpy(channels != UNSEEN)
    given = torch.from_numpy(np.where(channels == UNSEEN, ROAD, channels))
    return Batch(given.long(), one_hot(given), mask[:, None].float(), fields, condition)
