"""Height maps of chunks from the road's elevations."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.field import Heights, TerrainField, fit_terrain


def build_heightmaps(
    surface: RoadSurface,
    chunks: Sequence[Chunk],
    rules: TerrainRules,
    seed: int,
    base: Heights | None = None,
) -> dict[Chunk, HeightMap]:
    """Heights of the ground at the corners of chunks.

    A height depends on the road, the rules, the seed and the place alone, so that neighbours
    share their border samples and a chunk is the same whichever others are built.

    Args:
        surface: Road; the ground meets its outline exactly.
        chunks: Tiles.
        rules: Relief and slopes.
        seed: The user's seed.
        base: Real terrain (`terrain.read.read_dem`), into which the road is laid; none: the
            terrain follows from the road.
    """
    field = fit_terrain(surface, rules, seed, base)
    return {chunk: _sample(field, chunk) for chunk in chunks}


def _sample(field: TerrainField, chunk: Chunk) -> HeightMap:
    points = np.stack(np.meshgrid(*chunk.corner_axes()), axis=-1).reshape(-1, 2)
    return HeightMap(chunk, field(points).reshape(HEIGHT_SAMPLES, HEIGHT_SAMPLES))
