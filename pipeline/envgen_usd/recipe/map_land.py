"""The land of a whole map: the road with landuse and terrain around it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from envgen_usd.chunks import Chunk, chunks_of_points, without_holes
from envgen_usd.city.plots.given_buildings import GivenBuildings
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.citygml.city_index import member_files
from envgen_usd.compressed_files import content_suffix
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.executors.executor import ALONE, LocalProcesses
from envgen_usd.free_memory import trim_memory
from envgen_usd.geometry.georeference import check_crs
from envgen_usd.geometry.raster_files import raster_files
from envgen_usd.landuse.area_statistics import is_learnt
from envgen_usd.landuse.blocks.empty_blocks import find_empty_blocks
from envgen_usd.landuse.given_landuse import GivenLanduse, read_given_landuse
from envgen_usd.landuse.landuse_provider import LanduseProvider
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.mapped_landuse import MappedLanduse
from envgen_usd.landuse.network.shipped_weights import find_height_weights, find_weights
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.models.environment_profile import Profile, RoadLook
from envgen_usd.models.ground import HeightMap, Heights
from envgen_usd.models.landuse import OPEN_USES, LanduseMap, Plot
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.geometry.raised_sidewalks import with_raised_sidewalks
from envgen_usd.opendrive.object_issues import object_issues
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.recipe.build_options import TOLERANCES, LandOptions
from envgen_usd.recipe.chunk_products import ChunkMaps
from envgen_usd.recipe.given_city import read_given_city
from envgen_usd.recipe.mapped_place import (
    MappedPlace,
    add_objects_of_map,
    add_plots_of_houses,
    buildings_of_map,
)
from envgen_usd.step_clock import Clock
from envgen_usd.terrain.dem_geotiff import Dem, read_dem
from envgen_usd.terrain.heightmaps import build_heightmaps
from envgen_usd.terrain.steep_ground import find_steep_ground
from envgen_usd.terrain.water_levels import lower_water

FARTHEST = 1e7
"""Largest number of an offset, metres: a quarter of the way around the Earth."""
_WITH_HEIGHT = 3

if TYPE_CHECKING:
    from envgen_usd.recipe.regional_build import RegionalMap


@dataclass(frozen=True)
class RoadFile:
    """What a build keeps of a road file; its XML tree takes eight times the memory of the roads.

    Attributes:
        network: Content of the file.
        files: The file and its included files.
    """

    network: RoadNetwork
    files: tuple[Path, ...]


@dataclass(frozen=True)
class Land:
    """The land of a whole map, before any file is written.

    Attributes:
        network: Content of the road file.
        surface: Road surfaces.
        chunks: Tiles of the map.
        maps: Landuse of each chunk.
        plots: Plots of the whole map.
        heightmaps: Ground heights of each chunk.
        given: Buildings of the user's city model, or `None`.
        issues: Repairs, decisions and omissions in the input.
        files: Role of an input to its files.
        regional: The regions of a large map, whose maps, plots and heights are not here, and whose
            surface has no triangles; `None` means that all is here.
    """

    network: RoadNetwork
    surface: RoadSurface
    chunks: Sequence[Chunk]
    maps: Mapping[Chunk, LanduseMap]
    plots: tuple[Plot, ...]
    heightmaps: Mapping[Chunk, HeightMap]
    given: GivenBuildings | None
    issues: tuple[Issue, ...]
    files: Mapping[str, tuple[Path, ...]]
    regional: "RegionalMap | None" = None

    def of(self, chunk: Chunk) -> ChunkMaps:
        """Returns the inputs of a chunk."""
        near = (self.heightmaps.get(other) for other in chunk.neighbours())
        return ChunkMaps(
            self.maps[chunk],
            self.heightmaps[chunk],
            tuple(heightmap for heightmap in near if heightmap is not None),
            self._plot_index.touching(chunk),
            None if self.given is None else self.given.standing(chunk),
        )

    @cached_property
    def _plot_index(self) -> PlotIndex:
        return PlotIndex(self.plots)


def lay_out_land(  # noqa: PLR0913, PLR0917 - what land follows from
    options: LandOptions,
    profile: Profile,
    clock: Clock,
    place: MappedPlace | None = None,
    road: RoadFile | None = None,
    executor: LocalProcesses = ALONE,
) -> Land:
    """Reads the road and lays landuse and terrain around it; writes no files.

    Args:
        options: Options of the land.
        profile: Environment.
        clock: Takes the time of each step.
        place: The map that the road was made from, or `None`.
        road: The road file, where it has been read already.
        executor: Builds the buildings of a map.

    Raises:
        EnvgenError: An input is unusable.
    """
    rules, base = profile.terrain, None
    with clock.step("road"):
        road = road or read_road_file(options.road, options.tolerance, profile.road.kerb_height)
        network = road.network
        surface = surface_of(network, options.tolerance, profile.road.marks)
        chunks = chunks_of_points(surface.vertices, land_beside(profile))
        if place is not None:
            # Fields between streets of a map would be holes in its land.
            chunks = without_holes(chunks)
        # All inputs are read first, so that errors appear before the long steps.
        given = given_buildings(options, surface, chunks)
        provider = landuse_provider(options, profile, surface, chunks)
        is_mapped = place is not None and options.landuse == "rules" and options.fill != "all"
        if place is not None and is_mapped:
            provider = place.landuse(options.fill)
    if terrain_file(options):
        with clock.step("given land"):
            base = given_land(options, surface, chunks)
    with clock.step("landuse"):
        maps = provider.generate(surface, chunks, profile, options.seed)
        plots = find_plots(maps, surface)
    with clock.step("terrain"):
        # Houses of a map stand on its land as it is.
        levelled = [plot for plot in plots if not is_mapped or plot.landuse in OPEN_USES]
        land = build_heightmaps(surface, chunks, rules, options.seed, base, levelled)
        steep = find_steep_ground(land, surface, rules)
        heightmaps = lower_water(land, maps, rules)
        if given is not None and len(options.city_offset) < _WITH_HEIGHT:
            road_plan = RoadPlan(surface.vertices[surface.triangles][:, :, :2])
            given.set_down(heightmaps.values(), road_plan, each=not isinstance(base, Dem))
        if place is not None:
            given = buildings_of_map(place, heightmaps, surface, profile, options, given, executor)
            if given is not None and options.fill != "all":
                add_objects_of_map(given, place, heightmaps, surface, profile, options)
                add_plots_of_houses(given, place, provider, plots, heightmaps)
    # Blocks of a map are as full as it says.
    empty = () if is_mapped else _empty_blocks(surface, plots, profile, options.seed)
    warnings = (*land_issues(provider, base), *(() if given is None else given.issues))
    issues = (*network.issues, *surface.issues, *check_crs(surface.crs), *steep, *empty, *warnings)
    files = input_files(options, profile, road)
    if place is not None:
        issues, files = (*place.issues, *issues), {**files, "osm": (place.file,)}
    return Land(network, surface, chunks, maps, plots, heightmaps, given, issues, files)


def _empty_blocks(
    surface: RoadSurface, plots: Sequence[Plot], profile: Profile, seed: int
) -> tuple[Issue, ...]:
    """Issues of blocks without plots, with the reason."""
    roadsides = find_roadsides(surface, profile.plots, seed)
    return find_empty_blocks(surface, roadsides, plots, profile.plots)


def gives_land(options: LandOptions) -> bool:
    """Tells whether files give a part of the land: they are read for the whole map at a time."""
    files = (options.city, options.osm, options.heightmap, options.terrain_network)
    return options.landuse != "rules" or any(path is not None for path in files)


def given_buildings(
    options: LandOptions, surface: RoadSurface, chunks: Sequence[Chunk]
) -> GivenBuildings | None:
    """Returns the buildings of the user's city model, or `None` without one.

    Raises:
        EnvgenError: The model or its offset is unusable.
    """
    offset = options.city_offset
    if options.city is None:
        if offset:
            raise EnvgenError("--city-offset moves a city model; give --city, too")
        return None
    if len(offset) not in {0, 2, 3} or not all(abs(value) <= FARTHEST for value in offset):
        shown = ",".join(f"{value:g}" for value in offset)
        raise EnvgenError(
            f"--city-offset {shown}: give two or three numbers of metres, X,Y or X,Y,Z, "
            f"of at most {FARTHEST:g}"
        )
    return read_given_city(options.city, surface, chunks, offset)


def read_road(
    path: Path, tolerance: float, look: RoadLook | None = None
) -> tuple[RoadFile, RoadSurface]:
    """Reads an OpenDRIVE file and returns its surface with the features beside the road.

    Args:
        path: OpenDRIVE file.
        tolerance: Chord error, metres, within `TOLERANCES`.
        look: Of an environment: sizes of what the file leaves open.

    Raises:
        EnvgenError: The file or the tolerance is unusable.
    """
    road = read_road_file(path, tolerance, look.kerb_height if look else 0.0)
    return road, surface_of(road.network, tolerance, look.marks if look else RMS_MARKS)


def read_road_file(path: Path, tolerance: float, kerb_height: float = 0.0) -> RoadFile:
    """Reads an OpenDRIVE file.

    Args:
        path: OpenDRIVE file.
        tolerance: Chord error, metres, within `TOLERANCES`.
        kerb_height: Height of sidewalks where the file gives none, metres.

    Raises:
        EnvgenError: The file or the tolerance is unusable.
    """
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        low, high = TOLERANCES
        raise EnvgenError(f"tolerance {tolerance:g} m: choose a value from {low:g} m to {high:g} m")
    reading = read(path)
    road = RoadFile(with_raised_sidewalks(reading.network, kerb_height), reading.files)
    del reading
    trim_memory()
    return road


def surface_of(network: RoadNetwork, tolerance: float, marks: MarkRules) -> RoadSurface:
    """Returns the surface of a network with the features beside the road.

    Raises:
        EnvgenError: No road has an area.
    """
    surface = build_surface(network, tolerance, marks)
    features = road_features(network)
    built = (surface.patches[index] for index in np.unique(surface.triangle_patch).tolist())
    issues = (*surface.issues, *object_issues(network, features, built))
    return replace(surface, features=features, issues=issues)


def input_files(
    options: LandOptions, profile: Profile, road: RoadFile
) -> dict[str, tuple[Path, ...]]:
    """Role of each of the user's files to the file and those that it references."""
    files: dict[str, tuple[Path, ...]] = {"road": road.files}
    for role, path in (
        ("landuse", landuse_file(options, profile)),
        ("terrain", terrain_file(options)),
    ):
        if path is not None:
            files[role] = raster_files(path) if path.suffix != ".safetensors" else (path,)
    if options.city is not None:
        json = content_suffix(options.city) in (".json", ".jsonl")
        files["city"] = (options.city, *(() if json else member_files(options.city)))
    return files


def landuse_provider(
    options: LandOptions, profile: Profile, surface: RoadSurface, chunks: Sequence[Chunk]
) -> LanduseProvider:
    """Returns the landuse provider: ``rules``, ``network``, or a raster.

    Raises:
        EnvgenError: The choice is unknown, or weights or raster are unusable.
    """
    path = landuse_file(options, profile)
    if path is None:
        return RuleProvider()
    if options.landuse == "network":
        from envgen_usd.landuse.network.network_provider import network_provider  # noqa: PLC0415 - slow

        return network_provider(path)
    return read_given_landuse(path, surface, chunks)


def land_issues(*sources: LanduseProvider | Heights | None) -> tuple[Issue, ...]:
    """What was decided beyond the user's rasters and maps, and what these lack."""
    given = (x for x in sources if isinstance(x, Dem | GivenLanduse | MappedLanduse))
    return tuple(issue for source in given for issue in source.issues)


def given_land(
    options: LandOptions, surface: RoadSurface, chunks: Sequence[Chunk]
) -> Heights | None:
    """Returns the land under the road: from a GeoTIFF, from a network, or `None`.

    Raises:
        EnvgenError: Both are given, or the given file is unusable.
    """
    path = terrain_file(options)
    if path is None:
        return None
    if path == options.heightmap:
        return read_dem(path, surface)
    from envgen_usd.landuse.network.heights.network_land import HeightNetwork  # noqa: PLC0415 - slow

    return HeightNetwork(path).land(surface, chunks, options.seed)


def terrain_file(options: LandOptions) -> Path | None:
    """File of the land: a GeoTIFF or a network's weights; `None` without either.

    Raises:
        EnvgenError: Both are given, or the weights do not exist.
    """
    if options.heightmap and options.terrain_network:
        raise EnvgenError("--terrain-network and --heightmap exclude each other")
    if options.terrain_network:
        return find_height_weights(options.terrain_network)
    return options.heightmap


def landuse_file(options: LandOptions, profile: Profile) -> Path | None:
    """File of the landuse: a raster or a network's weights; `None` for rules.

    A network of real places is shipped for learnt environments, and one of the rules' maps for
    hand-written ones.

    Raises:
        EnvgenError: The file does not exist.
    """
    if options.landuse_network and options.landuse != "network":
        raise EnvgenError("--landuse-network needs --landuse network")
    if options.landuse == "rules":
        return None
    if options.landuse == "network":
        return find_weights(options.landuse_network, learnt=is_learnt(profile))
    path = Path(options.landuse)
    if path.is_dir():
        raise EnvgenError(f"--landuse {path}: is a folder, not a file; name a raster in it")
    if not path.is_file():
        raise EnvgenError(f"--landuse {options.landuse}: neither 'rules', 'network' nor a file")
    return path
