"""What lies where on the whole map: the road, the landuse and the terrain around it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from envgen_usd.chunk_job import ChunkMaps
from envgen_usd.chunks import Chunk, chunks_of_points
from envgen_usd.city.given import GivenBuildings
from envgen_usd.clock import Clock
from envgen_usd.config import TOLERANCES, BuildOptions
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.geometry.georeference import check_crs
from envgen_usd.given_city import read_given_city
from envgen_usd.landuse.network.weights import find_weights
from envgen_usd.landuse.plots import find_plots
from envgen_usd.landuse.provider import LanduseProvider
from envgen_usd.landuse.read import read_given_landuse
from envgen_usd.landuse.rules import RuleProvider
from envgen_usd.models.ground import HeightMap, Heights
from envgen_usd.models.landuse import LanduseMap, Plot
from envgen_usd.models.profile import PlotRules, Profile, TerrainRules
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.surface import RoadSurface
from envgen_usd.opendrive.furniture import place_furniture
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.plain_terrain import plain_terrain
from envgen_usd.terrain.checks import find_steep_ground
from envgen_usd.terrain.heightmap import build_heightmaps
from envgen_usd.terrain.read import read_dem

BEYOND = 25.0
"""Land behind the deepest plots that is built at least, metres, so that none ends in the void."""


@dataclass(frozen=True)
class Land:
    """What lies where on the whole map, before anything is written.

    Attributes:
        network: What the road file says.
        surface: The roads.
        chunks: Tiles of the map.
        maps: Landuse of each chunk.
        plots: Plots of the whole map.
        heightmaps: Ground of each chunk.
        given: Buildings of a file, or none.
        issues: What was odd in the input.
    """

    network: RoadNetwork
    surface: RoadSurface
    chunks: Sequence[Chunk]
    maps: Mapping[Chunk, LanduseMap]
    plots: tuple[Plot, ...]
    heightmaps: Mapping[Chunk, HeightMap]
    given: GivenBuildings | None
    issues: tuple[Issue, ...]

    def of(self, chunk: Chunk) -> ChunkMaps:
        """What one chunk is built from."""
        near = (self.heightmaps.get(other) for other in chunk.neighbours())
        return ChunkMaps(
            self.maps[chunk],
            self.heightmaps[chunk],
            tuple(heightmap for heightmap in near if heightmap is not None),
            self.given.around(chunk) if self.given else None,
        )


def lay_out_land(options: BuildOptions, profile: Profile, clock: Clock) -> Land:
    """Reads the road and lays landuse and terrain around it; writes nothing.

    Raises:
        EnvgenError: Something in the input cannot be used.
    """
    rules, base = profile.terrain, None
    with clock.step("road"):
        network, surface = read_road(options.road, options.tolerance)
        chunks = chunks_of_points(surface.vertices, land_beside(profile.plots))
        # All that is given is read before anything is made, so that what is wrong is said at once.
        given = read_given_city(options.city, surface, chunks) if options.city else None
        provider = landuse_provider(options, surface)
    if terrain_file(options):
        with clock.step("given land"):
            base = given_land(options, surface, chunks, rules)
    with clock.step("landuse"):
        maps = provider.generate(surface, chunks, profile, options.seed)
        plots = find_plots(maps, surface)
    with clock.step("terrain"):
        heightmaps = build_heightmaps(surface, chunks, rules, options.seed, base, plots)
        steep = find_steep_ground(heightmaps, surface, rules)
    odd = given.issues if given else ()
    issues = (*network.issues, *surface.issues, *check_crs(surface.crs), *steep, *odd)
    return Land(network, surface, chunks, maps, plots, heightmaps, given, issues)


def land_beside(plots: PlotRules) -> float:
    """Width of the land beside the road that an environment needs, metres."""
    return plots.verge[1] + plots.rows * plots.depth[1] + BEYOND


def read_road(path: Path, tolerance: float) -> tuple[RoadNetwork, RoadSurface]:
    """Reads an OpenDRIVE file and turns it into a surface with what stands beside it.

    Args:
        path: The file.
        tolerance: Chord error, within `TOLERANCES`.

    Raises:
        EnvgenError: The file or the tolerance cannot be used.
    """
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        low, high = TOLERANCES
        raise EnvgenError(f"tolerance {tolerance:g} m: choose one from {low:g} m to {high:g} m")
    network = read_network(path)
    surface = build_surface(network, tolerance)
    furniture = (*surface.furniture, *place_furniture(network))
    return network, replace(surface, furniture=furniture)


def landuse_provider(options: BuildOptions, surface: RoadSurface) -> LanduseProvider:
    """Returns what makes the landuse: ``rules``, ``network``, or a raster that is read.

    Raises:
        EnvgenError: The choice is none of them, or weights or raster cannot be used.
    """
    path = landuse_file(options)
    if path is None:
        return RuleProvider()
    if options.landuse == "network":
        from envgen_usd.landuse.network.provider import NetworkProvider  # noqa: PLC0415 - slow

        return NetworkProvider(path)
    return read_given_landuse(path, surface)


def given_land(
    options: BuildOptions, surface: RoadSurface, chunks: Sequence[Chunk], rules: TerrainRules
) -> Heights | None:
    """Returns the land that the road is laid into: of a GeoTIFF, by a network, or none.

    Raises:
        EnvgenError: Both are asked for, or one cannot be used.
    """
    path = terrain_file(options)
    if path is None:
        return None
    if path == options.heightmap:
        return read_dem(path, surface)
    from envgen_usd.landuse.network.height_provider import HeightNetwork  # noqa: PLC0415 - slow

    return HeightNetwork(path).land(surface, chunks, rules, plain_terrain, options.seed)


def terrain_file(options: BuildOptions) -> Path | None:
    """The file that the land is made from: a GeoTIFF, or a network's weights; none for rules.

    Raises:
        EnvgenError: Both are asked for, or the weights are not there.
    """
    if options.heightmap and options.terrain_network:
        raise EnvgenError("--terrain-network and --heightmap exclude each other")
    if options.terrain_network:
        return find_weights(options.terrain_network)
    return options.heightmap


def landuse_file(options: BuildOptions) -> Path | None:
    """The file that the landuse is made from: a raster, or a network's weights; none for rules.

    Raises:
        EnvgenError: It is not there.
    """
    if options.landuse_network and options.landuse != "network":
        raise EnvgenError("--landuse-network belongs to --landuse network")
    if options.landuse == "rules":
        return None
    if options.landuse == "network":
        return find_weights(options.landuse_network)
    if not Path(options.landuse).is_file():
        raise EnvgenError(f"--landuse {options.landuse}: is neither 'rules', 'network' nor a file")
    return Path(options.landuse)
