"""Computes height maps of chunks from the road's elevation."""

from collections.abc import Sequence

from envgen_usd.chunks import Chunk
from envgen_usd.models.ground import HeightMap, Heights
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.landuse import Plot
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.terrain.terrain_field import fit_terrain


def build_heightmaps(  # noqa: PLR0913, PLR0917 - everything that moves the ground
    surface: RoadSurface,
    chunks: Sequence[Chunk],
    rules: TerrainRules,
    seed: int,
    base: Heights | None = None,
    plots: Sequence[Plot] = (),
) -> dict[Chunk, HeightMap]:
    """Computes ground heights at the corners of chunks.

    A height depends only on road, plots, rules, seed and position. Neighbouring chunks therefore
    share their border samples, and a chunk is independent of the selection of chunks.

    Args:
        surface: Road; the ground meets its outline exactly.
        chunks: Chunks to compute.
        rules: Relief and slopes.
        seed: The user's seed.
        base: Elevation model (`dem_geotiff.read_dem`) that the road is embedded in; `None` derives
            the terrain from the road.
        plots: Plots of the whole map, levelled on hills and on elevation models.
    """
    field = fit_terrain(surface, rules, seed, base, plots)
    return {chunk: HeightMap(chunk, field.on_grid(*chunk.corner_axes())) for chunk in chunks}
