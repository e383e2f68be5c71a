"""Landuse by a network, chunk by chunk; each chunk sees its finished neighbours."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from envgen_usd.chunks import LANDUSE_CELLS, Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.landuse_provider import LanduseProvider
from envgen_usd.landuse.network.chunk_windows import SIDE, gather, inner, lattice, mosaic, tile
from envgen_usd.landuse.network.class_repair import repair
from envgen_usd.landuse.network.data.class_channels import ROAD
from envgen_usd.landuse.network.data.environment_conditions import CONDITIONS, describe
from envgen_usd.landuse.network.data.known_fields import StreetIndex, expand, raw_fields
from envgen_usd.landuse.network.data.landuse_scenes import Scene, fields_index
from envgen_usd.landuse.network.data.raster_samples import street_free
from envgen_usd.landuse.network.hole_filling import UNSEEN, Chance, draw_chance, fill, schedule
from envgen_usd.landuse.network.model.generator import Generator, PlainUNet
from envgen_usd.landuse.network.place_provider import PlaceProvider
from envgen_usd.landuse.network.training.weights_file import read_network, read_target
from envgen_usd.models.array_types import BoolArray, ByteArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

BATCH = 4
"""Number of chunks per batch; a larger value uses more memory."""
_SHAPE = (LANDUSE_CELLS, LANDUSE_CELLS)


def network_provider(weights: Path) -> LanduseProvider:
    """The provider that a network needs: one of real places, or one of the rules' maps.

    Raises:
        EnvgenError: The weights cannot be read, or are of neither.
    """
    is_place = read_target(weights) == "place"
    return PlaceProvider(weights) if is_place else NetworkProvider(weights)


class NetworkProvider:
    """Landuse by a trained network.

    The street fields and the wood noise are drawn from the environment's ranges for the whole map;
    the network generates the map from them. Masked diffusion receives only the wood noise and
    samples the rest. Chunks are generated in four rounds, as on a checkerboard of two by two.
    Chunks of a round do not touch, so their order does not matter. A chunk depends on which of its
    neighbours are requested with it.
    """

    def __init__(self, weights: Path) -> None:
        """Reads the weights of a training run.

        Raises:
            EnvgenError: The weights cannot be read.
        """
        self._network = read_network(weights, "landuse")

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`.

        Raises:
            EnvgenError: All roads lie inside junctions.
        """
        if all(line.junction or len(line.s) < 2 for line in surface.roads):
            raise EnvgenError("the map has no road outside a junction; use --landuse rules")
        maps = _Making(self._network, surface, profile, seed)
        for turn in range(4):
            group = [c for c in sorted(chunks) if (c.x % 2) + 2 * (c.y % 2) == turn]
            for first in range(0, len(group), BATCH):
                maps.add(group[first : first + BATCH])
        joined, corner = mosaic(maps.done, ROAD)
        classes, plots = repair(joined)
        return {
            chunk: LanduseMap(
                chunk, tile(classes, chunk, corner).copy(), tile(plots, chunk, corner).copy()
            )
            for chunk in chunks
        }


class _Making:
    """State of a map during generation."""

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
        """Generates chunks that do not touch each other."""
        channels = np.stack([self._known(chunk) for chunk in chunks])
        fields = expand(torch.from_numpy(np.stack([self._fields(chunk) for chunk in chunks])))
        condition = self._condition.expand(len(chunks), -1)
        filled = fill(self._network, channels, fields, condition, self._chance(chunks))
        for chunk, window in zip(chunks, filled, strict=True):
            self.done[chunk] = inner(window)

    def _chance(self, chunks: Sequence[Chunk]) -> Chance:
        """The same style for the whole map, and random cells by chunk."""
        passes = schedule(self._network.config.passes)
        rngs = [generator(self._seed, "landuse", "passes", chunk.x, chunk.y) for chunk in chunks]
        style = int(generator(self._seed, "landuse", "style").integers(2**31))
        return replace(draw_chance(rngs, (SIDE, SIDE), passes), seeds=[style] * len(chunks))

    def _fields(self, chunk: Chunk) -> NDArray[np.float16]:
        raw = raw_fields(self._index, *lattice(chunk, 2))
        return raw if self._streets else street_free(raw)

    def _known(self, chunk: Chunk) -> ByteArray:
        """Known channels of a window: those of finished neighbours, and the road."""
        nothing = np.full(_SHAPE, UNSEEN, dtype=np.uint8)
        channels: ByteArray = gather(chunk, lambda c: self.done.get(c, nothing))
        road: BoolArray = self._outline.encloses_grid(*lattice(chunk, 1))
        return np.where(road, np.uint8(ROAD), channels)
