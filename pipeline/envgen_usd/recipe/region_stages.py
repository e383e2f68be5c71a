"""The land of a map, region by region: roads, layout, landuse, plots, terrain, heights, water.

Each stage makes a product of a region from the roads near it and from the products of the stage
before in it and in the regions around it. So the products of a stage are made in any order, by any
process, and are the same.
"""

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from envgen_usd.chunks import CHUNK_SIZE, Chunk
from envgen_usd.errors import Issue
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.empty_blocks import find_empty_blocks
from envgen_usd.landuse.land_layout import LandDrawing, LandLayout
from envgen_usd.landuse.land_part import LandPart
from envgen_usd.landuse.landuse_rules import lay_out, verges_of
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap, Heights
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.map_regions import MapRegions, Region
from envgen_usd.recipe.region_roads import BESIDE, build_roads, joined_roads, with_decks
from envgen_usd.recipe.stored_products import ProductStore
from envgen_usd.terrain.joined_terrain import SURROUNDINGS, joined_terrain
from envgen_usd.terrain.steep_ground import find_steep_ground
from envgen_usd.terrain.terrain_field import TerrainPart, fit_terrain
from envgen_usd.terrain.water_levels import lower_water

REACH = 300.0
"""Distance from a region within which its land depends on roads, metres.

Blocks that reach farther beyond their region are not filled as a whole. A larger value needs more
time and memory.
"""


@dataclass(frozen=True)
class RegionalLand:
    """What all processes know of a map.

    Attributes:
        folder: Folder of the products.
        regions: The regions.
        profile: The environment.
        land: The land without its roads.
        seed: The user's seed.
        tolerance: Chord error of the roads, metres.
    """

    folder: Path
    regions: MapRegions
    profile: Profile
    land: Heights
    seed: int
    tolerance: float
    _stores: dict[Path, ProductStore] = field(default_factory=dict, compare=False)

    @property
    def store(self) -> ProductStore:
        """The products."""
        return self._stores.setdefault(self.folder, ProductStore(self.folder))

    def __getstate__(self) -> dict[str, object]:
        """Leaves out what a process has read."""
        return {**self.__dict__, "_stores": {}}

    def around(self, stage: str, region: Region) -> Iterator[tuple[Region, Any]]:
        """Products of a stage of a region and of those around it."""
        for each in self.regions.beside(region):
            yield each, self.store.read(stage, each.name)

    def has(self, stage: str, region: Region) -> bool:
        """Tells whether all products of a stage of a region are there."""
        return all(self.store.has(part, region.name) for part in _PARTS.get(stage, (stage,)))

    def chunks(self, region: Region) -> tuple[Chunk, ...]:
        """Chunks of a region that have land beside a road."""
        chunks: tuple[Chunk, ...] = self.store.read("chunks", region.name)[0]
        return chunks


def build_region_roads(land: RegionalLand, region: Region, network: RoadNetwork) -> None:
    """Writes ``surface`` and ``roads`` (`RoadPiece`) of a region.

    Args:
        land: The map.
        region: The region.
        network: Its roads and those within `BESIDE`.
    """
    rules, margin = land.profile.road.marks, land.regions.margin
    surface, piece = build_roads(network, region, land.tolerance, rules, margin)
    land.store.write("surface", region.name, surface)
    land.store.write("roads", region.name, piece)


def lay_out_region(land: RegionalLand, region: Region, network: RoadNetwork) -> None:
    """Writes ``layout`` of a region, ``streets`` (road, roadsides), ``chunks`` (chunks, issues).

    Args:
        land: The map.
        region: The region.
        network: Its roads and those within `REACH`.
    """
    pieces = [piece for _, piece in land.around("roads", region)]
    chunks = {chunk for piece in pieces for chunk in piece.chunks if region.has(chunk)}
    road, issues = joined_roads(pieces, network, land.tolerance, region.around(REACH))
    first = land.regions.number(region) * _MOST_PLOTS + 1
    part = LandPart(region.bounds, land.regions.middle, land.regions.reach, first)
    layout = lay_out(with_decks(road, pieces), land.profile, land.seed, part)
    roadsides = tuple(find_roadsides(road, land.profile.plots, land.seed))
    # Neighbours read a layout, and need no verges of it: these follow from the roadsides.
    land.store.write("layout", region.name, replace(layout, verges=verges_of(())))
    land.store.write("streets", region.name, (replace(road, lanes=()), roadsides))
    land.store.write("chunks", region.name, (tuple(sorted(chunks)), issues))


_MOST_PLOTS = 10_000
"""Largest number of plots in a region."""
_DECIMALS = 6
"""Decimals of heights in metres, so that sums in another order give chunks the same border."""


def draw_region(land: RegionalLand, region: Region) -> None:
    """Writes ``landuse`` of a region: the maps of its chunks."""
    road, roadsides = land.store.read("streets", region.name)
    parts = [layout for _, layout in land.around("layout", region)]
    layout = LandLayout.joined(parts, verges_of(roadsides))
    drawing = LandDrawing(layout, Outline.of(road), land.profile, land.seed)
    maps = tuple(drawing.of(chunk) for chunk in land.chunks(region))
    land.store.write("landuse", region.name, maps)


def find_region_plots(land: RegionalLand, region: Region) -> None:
    """Writes ``plots`` of a region: those whose numbers it gave, and issues of its blocks."""
    layout, (road, roadsides) = (
        land.store.read(part, region.name) for part in ("layout", "streets")
    )
    numbers = frozenset(layout.numbers.tolist())
    found = find_plots(_maps(land, region, _touched(layout, region)), road, numbers)
    plots = tuple(plot for plot in found if int(plot.id.split("_")[1]) in numbers)
    blocks = replace(road, outline=_own_blocks(road, region))
    empty = find_empty_blocks(blocks, roadsides, found, land.profile.plots)
    land.store.write("plots", region.name, (plots, empty))


def _maps(land: RegionalLand, region: Region, wanted: Container[Chunk]) -> dict[Chunk, LanduseMap]:
    """The landuse of chunks of a region and of those around it."""
    drawn = chain.from_iterable(found for _, found in land.around("landuse", region))
    return {each.chunk: each for each in drawn if each.chunk in wanted}


def fit_region_terrain(land: RegionalLand, region: Region) -> None:
    """Writes ``terrain`` of a region: the difference of its ground from the land, or `None`."""
    road, _ = land.store.read("streets", region.name)
    bounds = region.around(SURROUNDINGS)
    plots = plots_around(land, region)
    part = TerrainPart(land.land, bounds)
    fitted = fit_terrain(road, land.profile.terrain, land.seed, None, plots, part)
    land.store.write("terrain", region.name, fitted.correction)


def build_region_heights(land: RegionalLand, region: Region) -> None:
    """Writes ``heights`` of a region: height maps of its chunks, and issues of steep ground."""
    road, _ = land.store.read("streets", region.name)
    corrections = ((each.bounds, found) for each, found in land.around("terrain", region))
    ground = joined_terrain(Outline.of(road), land.land, corrections, region.bounds)
    heights = {
        chunk: HeightMap(chunk, np.round(ground.on_grid(*chunk.corner_axes()), _DECIMALS))
        for chunk in land.chunks(region)
    }
    steep = find_steep_ground(heights, road, land.profile.terrain)
    land.store.write("heights", region.name, (tuple(heights.values()), steep))


def lower_region_water(land: RegionalLand, region: Region) -> None:
    """Writes ``water`` of a region: height maps of its chunks with water below the land.

    Basins are smaller than a region, so those that reach into it lie within those around it.
    """
    chunks = land.chunks(region)
    near = {other for chunk in chunks for other in (chunk, *chunk.neighbours())}
    maps = _maps(land, region, near)
    if not any((each.classes == LanduseClass.WATER).any() for each in maps.values()):
        land.store.write("water", region.name, land.store.read("heights", region.name)[0])
        return
    heights = {
        each.chunk: each for _, (found, _) in land.around("heights", region) for each in found
    }
    maps = _maps(land, region, heights)
    lowered = lower_water(heights, maps, land.profile.terrain, chunks)
    land.store.write("water", region.name, tuple(lowered.values()))


def plots_around(land: RegionalLand, region: Region) -> tuple[Plot, ...]:
    """Plots of a region and of those around it, in the order of their numbers."""
    plots = [plot for _, (found, _) in land.around("plots", region) for plot in found]
    return tuple(sorted(plots, key=lambda plot: int(plot.id.split("_")[1])))


_FROM_ROADS: Mapping[str, Callable[[RegionalLand, Region, RoadNetwork], None]] = {
    "roads": build_region_roads,
    "layout": lay_out_region,
}
_FROM_PRODUCTS: Mapping[str, Callable[[RegionalLand, Region], None]] = {
    "landuse": draw_region,
    "plots": find_region_plots,
    "terrain": fit_region_terrain,
    "heights": build_region_heights,
    "water": lower_region_water,
}
STAGES = (*_FROM_ROADS, *_FROM_PRODUCTS)
"""Stages in their order; all but the first need the products around a region."""
REACHES: Mapping[str, float] = {"roads": BESIDE, "layout": REACH}
"""Distance from a region within which a stage reads the roads themselves, metres."""
_PARTS: Mapping[str, tuple[str, ...]] = {
    "roads": ("surface", "roads"),
    "layout": ("chunks", "streets", "layout"),
}
"""Products of a stage that makes several."""


def make_product(
    land: RegionalLand, stage: str, region: Region, network: RoadNetwork | None
) -> None:
    """Makes what a stage makes of a region.

    Args:
        land: The map.
        stage: One of `STAGES`.
        region: The region.
        network: Its roads and those within `REACHES`; `None` for the other stages.
    """
    if network is None:
        _FROM_PRODUCTS[stage](land, region)
    else:
        _FROM_ROADS[stage](land, region, network)


def _own_blocks(surface: RoadSurface, region: Region) -> tuple[np.ndarray, ...]:
    """Loops of the outline whose south-western corner lies in a region."""
    loops = [loop for loop in surface.outline if len(loop) > 2]
    plans = [surface.vertices[loop, :2] for loop in loops]
    corners = np.array([plan[np.lexsort(plan.T)[0]] for plan in plans]).reshape(-1, 2)
    own = region.holds(corners).tolist()
    return tuple(loop for loop, is_own in zip(loops, own, strict=True) if is_own)


def _touched(layout: LandLayout, region: Region) -> frozenset[Chunk]:
    """Chunks that show a region's plots or touch such a chunk."""
    boxes = np.concatenate([[region.bounds], shapely.bounds(layout.plots).reshape(-1, 4)])
    low = np.floor(boxes[:, :2].min(axis=0) / CHUNK_SIZE).astype(int) - 1
    high = np.floor(boxes[:, 2:].max(axis=0) / CHUNK_SIZE).astype(int) + 1
    return frozenset(
        Chunk(x, y) for x in range(low[0], high[0] + 1) for y in range(low[1], high[1] + 1)
    )


def joined_issues(parts: Iterable[Sequence[Issue]]) -> tuple[Issue, ...]:
    """Issues of regions, each once, in the order of the regions."""
    return tuple(dict.fromkeys(issue for part in parts for issue in part))
