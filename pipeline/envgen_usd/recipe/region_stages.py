"""The land of a map, region by region: roads, layout, landuse, plots, terrain, heights, water.

Each stage makes a product of a region from the roads near it and from the products of the stage
before in it and in the regions around it. So the products of a stage are made in any order, by any
process, and are the same.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from envgen_usd.chunks import CHUNK_SIZE, Chunk, chunks_of_points
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.blocks.empty_blocks import find_empty_blocks
from envgen_usd.landuse.land_layout import LandDrawing, LandLayout
from envgen_usd.landuse.land_part import LandPart
from envgen_usd.landuse.landuse_rules import lay_out
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap, Heights
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.map_land import surface_of
from envgen_usd.recipe.map_regions import MapRegions, Region
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
_PLACE = re.compile(r"(road|junction)\[id=(.*?)\]")


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
        parts = ("surface", "roads", "layout") if stage == "layout" else (stage,)
        return all(self.store.has(part, region.name) for part in parts)

    def chunks(self, region: Region) -> tuple[Chunk, ...]:
        """Chunks of a region that have land beside a road."""
        chunks: tuple[Chunk, ...] = self.store.read("roads", region.name)[0]
        return chunks


def lay_out_region(land: RegionalLand, region: Region, network: RoadNetwork) -> None:
    """Writes ``surface``, ``roads`` (chunks, issues, lanes) and ``layout`` (polygons, road).

    ``layout`` comes last, since a killed process must not leave it without the others.

    Args:
        land: The map.
        region: The region.
        network: Its roads and those within `REACH`.
    """
    try:
        surface = surface_of(network, land.tolerance, land.profile.road.marks)
    except EnvgenError:
        surface = _bare(network)
    near = chunks_of_points(surface.vertices, land.regions.margin)
    chunks = tuple(chunk for chunk in near if region.has(chunk))
    own = _own_roads(surface, region)
    lanes = tuple(lane for lane in surface.lanes if lane.road in own)
    first = land.regions.number(region) * _MOST_PLOTS + 1
    part = LandPart(region.bounds, land.regions.middle, land.regions.reach, first)
    layout = lay_out(surface, land.profile, land.seed, part)
    issues = tuple(_own_issues(surface, own))
    # Features follow from the roads in less time than they are read.
    mesh = replace(surface, features=(), issues=())
    land.store.write("surface", region.name, mesh)
    land.store.write("roads", region.name, (chunks, issues, lanes))
    land.store.write("layout", region.name, (layout, _outline_alone(surface)))


_MOST_PLOTS = 10_000
"""Largest number of plots in a region."""
_DECIMALS = 6
"""Decimals of heights in metres, so that sums in another order give chunks the same border."""


def draw_region(land: RegionalLand, region: Region) -> None:
    """Writes ``landuse`` of a region: the maps of its chunks."""
    parts = [layout for _, (layout, _) in land.around("layout", region)]
    own, surface = land.store.read("layout", region.name)
    layout = LandLayout.joined(parts, own.verges)
    drawing = LandDrawing(layout, Outline.of(surface), land.profile, land.seed)
    maps = tuple(drawing.of(chunk) for chunk in land.chunks(region))
    land.store.write("landuse", region.name, maps)


def find_region_plots(land: RegionalLand, region: Region) -> None:
    """Writes ``plots`` of a region: those whose numbers it gave, and issues of its blocks."""
    layout, surface = land.store.read("layout", region.name)
    wanted = _touched(layout, region)
    maps: dict[Chunk, LanduseMap] = {}
    for _, drawn in land.around("landuse", region):
        maps |= {each.chunk: each for each in drawn if each.chunk in wanted}
    numbers = frozenset(layout.numbers.tolist())
    found = find_plots(maps, surface, numbers)
    plots = tuple(plot for plot in found if int(plot.id.split("_")[1]) in numbers)
    blocks = replace(surface, outline=_own_blocks(surface, region))
    roadsides = find_roadsides(surface, land.profile.plots, land.seed)
    empty = find_empty_blocks(blocks, roadsides, found, land.profile.plots)
    land.store.write("plots", region.name, (plots, empty))


def fit_region_terrain(land: RegionalLand, region: Region) -> None:
    """Writes ``terrain`` of a region: the difference of its ground from the land, or `None`."""
    _, surface = land.store.read("layout", region.name)
    bounds = region.around(SURROUNDINGS)
    plots = plots_around(land, region)
    part = TerrainPart(land.land, bounds)
    fitted = fit_terrain(surface, land.profile.terrain, land.seed, None, plots, part)
    land.store.write("terrain", region.name, fitted.correction)


def build_region_heights(land: RegionalLand, region: Region) -> None:
    """Writes ``heights`` of a region: height maps of its chunks, and issues of steep ground."""
    _, surface = land.store.read("layout", region.name)
    corrections = ((each.bounds, found) for each, found in land.around("terrain", region))
    ground = joined_terrain(Outline.of(surface), land.land, corrections, region.bounds)
    heights = {
        chunk: HeightMap(chunk, np.round(ground.on_grid(*chunk.corner_axes()), _DECIMALS))
        for chunk in land.chunks(region)
    }
    steep = find_steep_ground(heights, surface, land.profile.terrain)
    land.store.write("heights", region.name, (tuple(heights.values()), steep))


def lower_region_water(land: RegionalLand, region: Region) -> None:
    """Writes ``water`` of a region: height maps of its chunks with water below the land.

    Basins are smaller than a region, so those that reach into it lie within those around it.
    """
    chunks = land.chunks(region)
    maps = {each.chunk: each for _, drawn in land.around("landuse", region) for each in drawn}
    near = {other for chunk in chunks for other in (chunk, *chunk.neighbours())}
    if not any((maps[c].classes == LanduseClass.WATER).any() for c in near & maps.keys()):
        land.store.write("water", region.name, land.store.read("heights", region.name)[0])
        return
    heights = {
        each.chunk: each for _, (found, _) in land.around("heights", region) for each in found
    }
    lowered = lower_water(heights, maps, land.profile.terrain, chunks)
    land.store.write("water", region.name, tuple(lowered.values()))


def plots_around(land: RegionalLand, region: Region) -> tuple[Plot, ...]:
    """Plots of a region and of those around it, in the order of their numbers."""
    plots = [plot for _, (found, _) in land.around("plots", region) for plot in found]
    return tuple(sorted(plots, key=lambda plot: int(plot.id.split("_")[1])))


STAGES: Mapping[str, Callable[[RegionalLand, Region], None]] = {
    "landuse": draw_region,
    "plots": find_region_plots,
    "terrain": fit_region_terrain,
    "heights": build_region_heights,
    "water": lower_region_water,
}
"""Stages after ``layout``, in their order; each needs the products around a region."""


def _bare(network: RoadNetwork) -> RoadSurface:
    """The surface of roads without an area."""
    faces = (np.empty((0, 3), np.int64), *(np.empty(0, np.int64),) * 2)
    crs, offset = network.geo_reference, network.offset[:3]
    return RoadSurface(np.empty((0, 3)), *faces, (), (), (), (), crs=crs, offset=offset)


def _outline_alone(surface: RoadSurface) -> RoadSurface:
    """The outline and the reference lines of a surface, without its triangles and lanes' shapes."""
    loops = [loop for loop in surface.outline if len(loop) > 0]
    sizes = np.cumsum([0, *(len(loop) for loop in loops)])
    places = np.concatenate([np.empty(0, np.int64), *loops])
    return RoadSurface(
        surface.vertices[places],
        *(np.empty((0, 3), np.int64), np.empty(0, np.int64), np.empty(0, np.int64), ()),
        outline=tuple(np.arange(a, b) for a, b in pairwise(sizes)),
        lanes=surface.lanes,
        roads=surface.roads,
        crs=surface.crs,
        offset=surface.offset,
    )


def _own_roads(surface: RoadSurface, region: Region) -> frozenset[str]:
    """Ids of the roads whose middle lies in a region."""
    middles = np.array([line.points[len(line.points) // 2, :2] for line in surface.roads])
    own = region.holds(middles.reshape(-1, 2)).tolist()
    return frozenset(line.road for line, is_own in zip(surface.roads, own, strict=True) if is_own)


def _own_issues(surface: RoadSurface, roads: frozenset[str]) -> Iterator[Issue]:
    """Issues of the roads of a region, and of junctions whose first road is one of them."""
    first: dict[str, str] = {}
    for line in surface.roads:
        first.setdefault(line.junction, line.road)
    for issue in surface.issues:
        place = _PLACE.match(issue.where)
        if place is None or (place[2] if place[1] == "road" else first.get(place[2], "")) in roads:
            yield issue


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
