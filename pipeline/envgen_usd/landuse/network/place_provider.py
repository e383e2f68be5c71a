"""Landuse by a network of real places, chunk by chunk; each chunk sees its finished neighbours."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.area_statistics import environment_statistics, is_learnt
from envgen_usd.landuse.network.chunk_windows import HALO, SIDE, gather, inner, mosaic, tile
from envgen_usd.landuse.network.data.cell_order import dispersed_order
from envgen_usd.landuse.network.data.place_channels import GIVEN
from envgen_usd.landuse.network.data.place_sample import AROUND, place_condition, place_fields
from envgen_usd.landuse.network.hole_filling import UNSEEN, Chance, fill, gumbel, schedule
from envgen_usd.landuse.network.place_filling import land_of_channels
from envgen_usd.landuse.network.tasks.place_task import place_field_channels
from envgen_usd.landuse.network.training.weights_file import read_network
from envgen_usd.landuse.place_landuse import PlaceLand
from envgen_usd.landuse.place_plots import with_straight_plots
from envgen_usd.models.array_types import BoolArray, ByteArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.seeds import generator

_ROAD = GIVEN.index(LanduseClass.ROAD)


class PlaceProvider:
    """Landuse as in the real places that a network has learnt.

    Chunks are filled in four rounds, as on a checkerboard of two by two, so their order does not
    matter. Buildings decide about plots once the whole map is filled; they are not kept, since the
    environment plans its own.
    """

    def __init__(self, weights: Path) -> None:
        """Reads the weights of a training run.

        Raises:
            EnvgenError: The weights cannot be read.
        """
        self._network = read_network(weights, "place")

    def generate(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> dict[Chunk, LanduseMap]:
        """See `LanduseProvider.generate`.

        Raises:
            EnvgenError: The network's output is not finite.
        """
        land, first = self.land(surface, chunks, profile, seed)
        land = with_straight_plots(land, corner_of(first), surface, profile, seed)
        return maps_of(land, first, chunks)

    def land(
        self, surface: RoadSurface, chunks: Sequence[Chunk], profile: Profile, seed: int
    ) -> tuple[PlaceLand, Chunk]:
        """Land as sampled, with plots that are not yet straight.

        Args:
            surface: The whole road.
            chunks: Tiles.
            profile: Environment.
            seed: The user's seed.

        Returns:
            Cells of the rectangle around the chunks; and the chunk in its corner.

        Raises:
            EnvgenError: The network's output is not finite.
        """
        outline, done = Outline.of(surface), dict[Chunk, ByteArray]()
        figures = place_condition(environment_statistics(profile), is_real=is_learnt(profile))
        condition = torch.from_numpy(figures)[None]
        for turn in range(4):
            for chunk in sorted(c for c in chunks if (c.x % 2) + 2 * (c.y % 2) == turn):
                road = _road(outline, chunk)
                base = np.where(road, LanduseClass.ROAD, LanduseClass.GRASS).astype(np.uint8)
                fields = place_field_channels(torch.from_numpy(place_fields(base))[None])
                known = _known(chunk, done, road[AROUND:-AROUND, AROUND:-AROUND])[None]
                chance = self._chance(chunk, seed)
                done[chunk] = inner(fill(self._network, known, fields, condition, chance)[0])
        joined, first = mosaic(done, _ROAD)
        return land_of_channels(joined), first

    def _chance(self, chunk: Chunk, seed: int) -> Chance:
        """One order and one style for the whole map, and samples by chunk."""
        rng = generator(seed, "landuse", "passes", chunk.x, chunk.y)
        corner = (chunk.y * LANDUSE_CELLS - HALO, chunk.x * LANDUSE_CELLS - HALO)
        order = dispersed_order((SIDE, SIDE), generator(seed, "landuse", "order"), corner)
        noise = gumbel(rng, (self._network.task.outputs, SIDE, SIDE))
        style = int(generator(seed, "landuse", "style").integers(2**31))
        return Chance(order[None], noise[None], [style], schedule(self._network.config.passes))


def maps_of(land: PlaceLand, first: Chunk, chunks: Sequence[Chunk]) -> dict[Chunk, LanduseMap]:
    """Land cut into chunks; the first is that in its corner."""
    return {
        chunk: LanduseMap(
            chunk, tile(land.classes, chunk, first).copy(), tile(land.plots, chunk, first).copy()
        )
        for chunk in chunks
    }


def corner_of(chunk: Chunk) -> tuple[int, int]:
    """Column and row of a chunk's first cell on the map's lattice."""
    return chunk.x * LANDUSE_CELLS, chunk.y * LANDUSE_CELLS


def _road(outline: Outline, chunk: Chunk) -> BoolArray:
    """Road in a window with `AROUND` cells on each side."""
    steps = np.arange(SIDE + 2 * AROUND, dtype=np.float64)
    offsets = (steps + 0.5 - HALO - AROUND) * CELL_SIZE
    x, y = chunk.origin
    return outline.encloses_grid(x + offsets, y + offsets)


def _known(chunk: Chunk, done: dict[Chunk, ByteArray], road: BoolArray) -> ByteArray:
    """Known channels of a window: those of finished neighbours, and the road."""
    nothing = np.full((LANDUSE_CELLS, LANDUSE_CELLS), UNSEEN, dtype=np.uint8)
    channels: ByteArray = gather(chunk, lambda c: done.get(c, nothing))
    return np.where(road, np.uint8(_ROAD), channels)
