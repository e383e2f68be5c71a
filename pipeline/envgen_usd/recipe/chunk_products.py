"""Builds all products of a chunk into a folder that is written whole or not at all."""

import pickle
import shutil
import tempfile
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.chunks import CITY_FILE
from envgen_usd.city.generate import build_city, pave_ways, plan_city
from envgen_usd.city.plots.given_buildings import Standing
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.landuse_geojson import write_regions
from envgen_usd.landuse.landuse_geotiff import write_landuse_map
from envgen_usd.landuse.landuse_regions import find_regions
from envgen_usd.landuse.road_areas import RoadAreas
from envgen_usd.layers.actors_layer import write_actors
from envgen_usd.layers.buildings_layer import write_buildings
from envgen_usd.layers.landuse_layer import write_landuse
from envgen_usd.layers.parked_looks import parked_looks
from envgen_usd.layers.props_layer import write_props
from envgen_usd.layers.roads_layer import write_roads
from envgen_usd.layers.terrain_layer import write_terrain
from envgen_usd.models.city_model import City
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import GroundMesh, HeightMap
from envgen_usd.models.landuse import LanduseMap, Plot
from envgen_usd.models.parked_actors import Looks
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.chunk_summaries import write_summary
from envgen_usd.recipe.street_obstacles import street_obstacles
from envgen_usd.recipe.unchanged_chunks import RECORD, ChunkRecord, write_record
from envgen_usd.terrain.ground_mesh import build_ground
from envgen_usd.terrain.heightmap_geotiff import write_heightmap
from envgen_usd.traffic.standing.street_facts import StreetFacts
from envgen_usd.traffic.standing.street_life import NEAR, Street, place_actors, signs_beside_rows
from envgen_usd.whole_files import whole_file


class RoadLand(Protocol):
    """The roads of a map; see `map_land.Land`."""

    @property
    def network(self) -> RoadNetwork:
        """Content of the road file."""

    @property
    def surface(self) -> RoadSurface:
        """Road surfaces."""


@dataclass(frozen=True)
class ChunkInputs:
    """Inputs shared by all chunks.

    Attributes:
        folder: Folder that holds one folder for each chunk.
        roads: All roads, by place.
        outline: Where the ground meets them.
        areas: The ground that they cover.
        profile: The environment.
        catalogue: The asset library.
        seed: Random seed of the build.
        metadata_only: True for props without geometry.
        street: What the road file says about parking; `None` where the environment has no actors.
        looks: Looks of the actors.
        empty: True for streets without them; signs still allow what vehicles would do.
        generated: False where only what a map has stands beside the road.
        reads_back: True to make the layers from the written city model; they are the same where
            all of it is ours, and this takes a sixth of a build. A model of others may change as it
            is written.
    """

    folder: Path
    roads: RoadIndex
    outline: Outline
    areas: RoadAreas
    profile: Profile
    catalogue: Catalogue
    seed: int
    metadata_only: bool
    street: StreetFacts | None = None
    looks: Looks = field(default_factory=dict)
    empty: bool = False
    generated: bool = True
    reads_back: bool = False

    @staticmethod
    def of(
        folder: Path,
        land: RoadLand,
        profile: Profile,
        catalogue: Catalogue,
        options: BuildOptions,
    ) -> "ChunkInputs":
        """Returns the inputs for a map; all that takes a look at the whole of it is done here."""
        surface = land.surface
        may_have_actors = streets_have_actors(profile, replace(options, actors=True))
        return ChunkInputs(
            folder,
            RoadIndex(surface),
            Outline.of(surface),
            RoadAreas(surface),
            profile,
            catalogue,
            options.seed,
            options.metadata_only,
            StreetFacts.of(surface, land.network) if may_have_actors else None,
            parked_looks(profile, catalogue) if may_have_actors else {},
            not options.actors,
            _is_generated(options),
            options.city is not None,
        )


def streets_have_actors(profile: Profile, options: BuildOptions) -> bool:
    """Tells whether vehicles and people stand on the streets of a build."""
    return options.actors and profile.actors is not None and _is_generated(options)


def _is_generated(options: BuildOptions) -> bool:
    """False where only what a map has stands beside the road."""
    return options.osm is None or options.fill != "none"


@dataclass(frozen=True)
class ChunkMaps:
    """Inputs of a single chunk.

    Attributes:
        landuse: Landuse of the chunk.
        heightmap: Ground of the chunk.
        around: Ground of the chunks around it.
        plots: Plots in the chunk and those that reach into it.
        buildings: Given buildings; `None`: they are generated.
    """

    landuse: LanduseMap
    heightmap: HeightMap
    around: tuple[HeightMap, ...]
    plots: tuple[Plot, ...]
    buildings: Standing | None = None


def build_chunk(inputs: ChunkInputs, maps: ChunkMaps, key: str) -> ChunkRecord:
    """Writes all products of a chunk; an older folder of that chunk is replaced at the end.

    Args:
        inputs: Inputs shared by all chunks.
        maps: Inputs of this chunk.
        key: Hash of all inputs of the chunk; stored with it.

    Returns:
        The chunk's record, which lies in its folder, too.
    """
    name = maps.landuse.chunk.name
    final = inputs.folder / name
    with tempfile.TemporaryDirectory(dir=inputs.folder, prefix=f".{name}.") as folder:
        work = Path(folder) / name
        work.mkdir()
        record = _write_products(inputs, maps, work)
        write_record(work, key, record)
        if final.exists():
            # A partial folder must not look like a complete folder.
            (final / RECORD).unlink(missing_ok=True)
            shutil.rmtree(final)
        work.replace(final)
    return record


def _write_products(inputs: ChunkInputs, maps: ChunkMaps, work: Path) -> ChunkRecord:
    landuse, heightmap = maps.landuse, maps.heightmap
    chunk, profile, seed = landuse.chunk, inputs.profile, inputs.seed
    roads, catalogue, plots = inputs.roads, inputs.catalogue, maps.plots
    surface = roads.surface
    plan = plan_city(chunk, plots, roads, heightmap, profile, seed, maps.around, maps.buildings)
    landuse = pave_ways(plan, landuse)
    write_heightmap(heightmap, work / "heightmap.tif", surface.crs, surface.offset)
    write_landuse_map(landuse, work / "landuse.tif", surface.crs, surface.offset)
    regions = find_regions(landuse, plots, inputs.areas)
    write_regions(regions, work / "landuse.geojson", surface.crs, surface.offset)
    ground = build_ground(heightmap, inputs.outline, landuse)
    write_terrain(ground, work / "terrain.usdc")
    write_landuse(ground, landuse, profile, catalogue, work / "landuse.usdc")
    generated = build_city(plan, landuse, profile, walls=ground, generated=inputs.generated)
    write_city(generated, work / CITY_FILE)
    # The stage follows from what the file says, so that any other city model can replace it.
    city = read_city(work / CITY_FILE) if inputs.reads_back else generated
    write_roads(city, chunk, profile, catalogue, work / "roads.usdc")
    write_buildings(city, chunk, profile, catalogue, work / "buildings.usdc")
    props, only = work / "props.usdc", inputs.metadata_only
    street, rules = _street(inputs, maps, city, ground), profile.actors
    signs = signs_beside_rows(street, rules) if street and rules else frozenset()
    write_props(
        city, chunk, profile, catalogue, seed, props, metadata_only=only, beside_parked=signs
    )
    actors = _write_actors(inputs, street, work) if street is not None else ChunkRecord({})
    kinds = ("Building", "SolitaryVegetationObject", "CityFurniture", "TrafficSpace")
    features = {kind: len(city.of_kind(kind)) for kind in kinds}
    write_summary(work, city)
    return ChunkRecord({**features, **actors.counts}, (*generated.issues, *actors.issues))


def _write_actors(inputs: ChunkInputs, street: Street, work: Path) -> ChunkRecord:
    """Writes the actors of a chunk; returns their counts, and issues where many had no room."""
    profile = inputs.profile
    if profile.actors is None or inputs.empty:
        return ChunkRecord({})
    actors, crowded = place_actors(street, profile.actors)
    write_actors(
        actors, street.chunk, profile, inputs.catalogue, inputs.seed, work / "actors.usdc",
        metadata_only=inputs.metadata_only,
    )  # fmt: skip
    return ChunkRecord(Counter(actor.look.kind for actor in actors), crowded)


def _street(inputs: ChunkInputs, maps: ChunkMaps, city: City, ground: GroundMesh) -> Street | None:
    """What the actors of a chunk follow from; `None` where the environment has none."""
    facts, chunk = inputs.street, maps.landuse.chunk
    if facts is None:
        return None
    return Street(
        chunk,
        facts,
        inputs.roads.pieces.lanes_near(chunk.bounds, NEAR),
        inputs.roads.corners_near(chunk.bounds, NEAR),
        ground,
        city,
        street_obstacles(city, inputs.catalogue),
        maps.plots,
        inputs.looks,
        inputs.seed,
    )


_shared: tuple[ChunkInputs, str]


def write_shared(inputs: ChunkInputs, path: Path) -> None:
    """Writes the inputs shared by all chunks to a file for `start_worker`."""
    with whole_file(path) as part, part.open("wb") as file:
        pickle.dump(inputs, file, pickle.HIGHEST_PROTOCOL)


def start_worker(path: Path, key: str) -> None:
    """Reads the shared inputs once in each worker process."""
    global _shared  # noqa: PLW0603 - the state of a worker process
    with path.open("rb") as file:
        _shared = pickle.load(file), key


def build_in_worker(maps: ChunkMaps) -> ChunkRecord:
    """Builds a chunk in a process that `start_worker` has prepared."""
    inputs, key = _shared
    return build_chunk(inputs, maps, key)
