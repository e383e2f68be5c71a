"""Builds a map of several regions: no process lays out more than a region at a time."""

import itertools
import pickle
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from pathlib import Path

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.executors.executor import Tasks
from envgen_usd.free_memory import trim_memory
from envgen_usd.geometry.georeference import check_crs
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.network_window import NetworkWindows
from envgen_usd.opendrive.reference_samples import ReferenceSamples
from envgen_usd.output_folder import create_folder
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.chunk_products import ChunkInputs, ChunkMaps, build_chunk
from envgen_usd.recipe.map_land import Land, RoadFile, input_files
from envgen_usd.recipe.map_regions import MapRegions, Region
from envgen_usd.recipe.region_roads import BESIDE
from envgen_usd.recipe.region_stages import (
    REACHES,
    STAGES,
    RegionalLand,
    joined_issues,
    make_product,
    plots_around,
)
from envgen_usd.recipe.unchanged_chunks import ChunkRecord
from envgen_usd.step_clock import Clock, Progress
from envgen_usd.terrain.land_guess import land_through
from envgen_usd.whole_files import temporary_folder, whole_file

_WITH_ISSUES = ("chunks", "heights", "plots")
"""Products whose second part are issues."""
_KEY = 16
"""Characters of the key that name the folder of a build's regions."""
FOLDER = "land"
"""Folder of the products of regions in the output folder; a finished build removes it."""


@dataclass(frozen=True)
class RegionalMap:
    """A map that is laid out region by region.

    Attributes:
        road: The road file.
        land: What all processes know of the map.
        regions: The regions whose chunks this process builds.
    """

    road: RoadFile
    land: RegionalLand
    regions: tuple[Region, ...]

    @property
    def network(self) -> RoadNetwork:
        """Content of the road file."""
        return self.road.network

    def near(self, region: Region, reach: float) -> RoadNetwork:
        """The roads of a region and those within a distance of it, metres."""
        return self._windows.near(region.around(reach))

    @cached_property
    def _windows(self) -> NetworkWindows:
        return NetworkWindows(self.network, self.land.regions.boxes)

    def chunks(self) -> tuple[Chunk, ...]:
        """Chunks of the regions, sorted."""
        return tuple(sorted(chain(*map(self.land.chunks, self.regions))))

    def part(self, shard: tuple[int, int]) -> "RegionalMap":
        """The map with the regions of part i of n alone; with all, if there are fewer regions."""
        number, count = shard
        if len(self.regions) < count:
            return self
        first, end = (len(self.regions) * n // count for n in (number - 1, number))
        return replace(self, regions=self.regions[first:end])

    def issues(self) -> tuple[Issue, ...]:
        """Issues of the roads, of steep ground and of empty blocks."""
        store, names = self.land.store, [region.name for region in self.regions]
        roads = (store.read("roads", name).issues for name in names)
        others = (store.read(stage, name)[1] for stage in _WITH_ISSUES for name in names)
        return joined_issues(chain(roads, others))

    def surface(self) -> RoadSurface:
        """The lanes and the features of the map, without any triangles."""
        network, store = self.network, self.land.store
        lanes = chain(*(store.read("roads", region.name).lanes for region in self.regions))
        order = {road: number for number, road in enumerate(network.roads)}
        like: RoadSurface = store.read("streets", self.regions[0].name)[0]
        return replace(
            like,
            outline=(),
            lanes=tuple(sorted(lanes, key=lambda lane: order[lane.road])),
            roads=(),
            features=road_features(network),
        )


def regional_map(options: BuildOptions, profile: Profile, road: RoadFile) -> RegionalMap | None:
    """Divides a map into regions; `None` where it is one."""
    samples = ReferenceSamples.of(road.network)
    if not len(samples.boxes):
        return None
    regions = MapRegions.of(samples.boxes, land_beside(profile))
    if len(regions.all) < 2:
        return None
    rules, seed = profile.terrain, options.seed
    ground = land_through(samples.points, samples.winding, rules, seed)
    folder = options.out.absolute() / FOLDER
    land = RegionalLand(folder, regions, profile, ground, seed, options.tolerance)
    return RegionalMap(road, land, regions.all)


def lay_out_regions(regional: RegionalMap, options: BuildOptions, key: str, clock: Clock) -> Land:
    """Makes the products of the regions, and of those around them that they follow from.

    Products of builds with other inputs are removed.

    Args:
        regional: The map.
        options: Options of the build.
        key: Hash of all inputs.
        clock: Takes the time of each step.

    Raises:
        EnvgenError: No road has an area.
    """
    create_folder(options.out)  # a killed run leaves the folder of an environment
    parent, name = regional.land.folder, key[:_KEY]
    for other in parent.glob("*"):
        if other.name != name:
            shutil.rmtree(other, ignore_errors=True)
    regional = replace(regional, land=replace(regional.land, folder=parent / name))
    wanted, executor = _wanted(regional), options.tasks_executor()
    for stage in STAGES:
        regions, reach = wanted[stage], REACHES.get(stage)
        jobs = [
            (stage, each, None if reach is None else regional.near(each, reach))
            for each in regions
            if not regional.land.has(stage, each)
        ]
        with clock.step(stage, len(jobs)):
            done = _counted(stage, len(jobs), clock.progress)
            tasks = Tasks(_make_in_worker, jobs, _start_land, (regional.land,))
            executor.run(tasks, done)
    chunks = regional.chunks()
    if not chunks and regional.regions == regional.land.regions.all:
        raise EnvgenError(f"{regional.network.name}: no road has a lane with a width")
    surface = regional.surface()
    files = input_files(options, regional.land.profile, regional.road)
    issues = (*regional.network.issues, *regional.issues(), *check_crs(surface.crs))
    return Land(regional.network, surface, chunks, {}, (), {}, None, issues, files, regional)


def remove_regions(out: Path) -> None:
    """Removes the products of regions from the output folder of a finished build."""
    shutil.rmtree(out / FOLDER, ignore_errors=True)


def _wanted(regional: RegionalMap) -> dict[str, list[Region]]:
    """The regions of each stage: those of the process first, then those that they follow from."""
    regions = list(regional.regions)
    wanted: dict[str, list[Region]] = {}
    for stage in reversed(STAGES):
        beside = chain(*(regional.land.regions.beside(region) for region in regions))
        regions = list(dict.fromkeys((*regions, *beside)))
        wanted[stage] = regions
    return wanted


@dataclass(frozen=True)
class RegionChunks:
    """Chunks of a region that are built together.

    Attributes:
        region: The region.
        network: Its roads and those within `BESIDE`.
        chunks: The chunks.
    """

    region: Region
    network: RoadNetwork
    chunks: tuple[Chunk, ...]


@dataclass(frozen=True)
class ChunkContext:
    """What the chunks of all regions share."""

    folder: Path
    land: RegionalLand
    catalogue: Catalogue
    options: BuildOptions
    key: str


def build_region_chunks(
    regional: RegionalMap,
    context: ChunkContext,
    chunks: Sequence[Chunk],
    progress: Progress,
) -> list[ChunkRecord]:
    """Builds chunks, region by region.

    Returns:
        Record of each chunk, in the order of completion.
    """
    executor = context.options.tasks_executor()
    jobs = [
        RegionChunks(region, regional.near(region, BESIDE), part)
        for region in regional.regions
        if (own := [chunk for chunk in chunks if region.has(chunk)])
        for part in _parts(own, executor.slots, len(regional.regions))
    ]
    records: list[ChunkRecord] = []

    def add(part: Sequence[ChunkRecord]) -> None:
        records.extend(part)
        progress("chunks", len(records), len(chunks))

    with temporary_folder(context.folder, ".shared.") as folder:
        shared = folder / "context.pickle"
        with whole_file(shared) as part, part.open("wb") as file:
            pickle.dump(context, file, pickle.HIGHEST_PROTOCOL)
        executor.run(Tasks(_build_in_worker, jobs, _start_chunks, (shared,)), add)
    return records


def _parts(chunks: Sequence[Chunk], workers: int, regions: int) -> list[tuple[Chunk, ...]]:
    """Divides the chunks of a region, if there are too few regions to occupy all workers."""
    count = min(max(2 * workers // regions, 1), len(chunks))
    return [tuple(chunks[number::count]) for number in range(count)]


def _counted(stage: str, total: int, progress: Progress) -> Callable[[object], None]:
    """Tells the progress of a stage each time it is called."""
    number = itertools.count(1)
    return lambda _: progress(stage, next(number), total)


_land: RegionalLand
_context: ChunkContext
_inputs: tuple[str, ChunkInputs] | None


def _start_land(land: RegionalLand) -> None:
    global _land  # noqa: PLW0603 - the state of a worker process
    _land = land


def _make_in_worker(job: tuple[str, Region, RoadNetwork | None]) -> None:
    """Makes a product of a region, unless another process has made it meanwhile."""
    stage, region, network = job
    if not _land.has(stage, region):
        make_product(_land, stage, region, network)
        trim_memory()


def _start_chunks(path: Path) -> None:
    global _context, _inputs
    with path.open("rb") as file:
        _context, _inputs = pickle.load(file), None


def _build_in_worker(job: RegionChunks) -> list[ChunkRecord]:
    """Builds chunks of a region."""
    global _inputs  # noqa: PLW0603 - the state of a worker process
    name, land, options = job.region.name, _context.land, _context.options
    if _inputs is None or _inputs[0] != name:
        roads = StreetLayout.of(land, job.region, job.network)
        folder, catalogue = _context.folder, _context.catalogue
        _inputs = name, ChunkInputs.of(folder, roads, land.profile, catalogue, options)
        trim_memory()
    inputs, maps = _inputs[1], RegionMaps(land, job.region)
    return [build_chunk(inputs, maps.of(chunk), _context.key) for chunk in job.chunks]


@dataclass(frozen=True)
class StreetLayout:
    """The roads near a region."""

    network: RoadNetwork
    surface: RoadSurface

    @staticmethod
    def of(land: RegionalLand, region: Region, network: RoadNetwork) -> "StreetLayout":
        """Reads the surface of a region that was made from the same roads."""
        surface: RoadSurface = land.store.read("surface", region.name)
        return StreetLayout(network, replace(surface, features=road_features(network)))


class RegionMaps:
    """The land of the chunks of a region."""

    def __init__(self, land: RegionalLand, region: Region) -> None:
        """Reads the products of a region and of those around it."""
        drawn = land.store.read("landuse", region.name)
        self._landuse: dict[Chunk, LanduseMap] = {each.chunk: each for each in drawn}
        self._heights: dict[Chunk, HeightMap] = {
            each.chunk: each
            for _, found in land.around("water", region)
            for each in found
            if region.has(each.chunk) or any(map(region.has, each.chunk.neighbours()))
        }
        self._plots = PlotIndex(plots_around(land, region))

    def of(self, chunk: Chunk) -> ChunkMaps:
        """Returns the inputs of a chunk."""
        near = (self._heights.get(other) for other in chunk.neighbours())
        around = tuple(heights for heights in near if heights is not None)
        plots = self._plots.touching(chunk)
        return ChunkMaps(self._landuse[chunk], self._heights[chunk], around, plots)
