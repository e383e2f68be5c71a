"""Height maps of chunks from the road's elevations."""

from collections.abc import Sequence

from envgen_usd.chunks import Chunk
from envgen_usd.models.ground import HeightMap, Heights
from envgen_usd.models.landuse import Plot
from envgen_usd.models.profile import TerrainRules
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.field import fit_terrain


def build_heightmaps(  # noqa: PLR0913, PLR0917 - everything that moves the ground
    surface: RoadSurface,
    chunks: Sequence[Chunk],
    rules: TerrainRules,
    seed: int,
    base: Heights | None = None,
    plots: Sequence[Plot] = (),
) -> dict[Chunk, HeightMap]:
    """Heights of the ground at the corners of chunks.

    A height depends on the road, the plots, the rules, the seed and the place alone, so that
    neighbours share their border samples and a chunk is the same whichever others are built.

    Args:
        surface: Road; the ground meets its outline exactly.
        chunks: Tiles.
        rules: Relief and slopes.
        seed: The user's seed.
        base: Real terrain (`terrain.read.read_dem`), into which the road is laid; none: the
            terrain follows from the road.
        plots: Of the whole map; on hills and on real terrain their ground is levelled.
    """
    field = fit_terrain(surface, rules, seed, base, plots)
    return {chunk: HeightMap(chunk, field.on_grid(*chunk.corner_axes())) for chunk in chunks}
