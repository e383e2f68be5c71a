"""Builds one chunk: every product of it, into a folder that appears at once."""

import json
import pickle
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.assets.catalogue import Catalogue
from envgen_usd.chunks import CITY_FILE, Chunk
from envgen_usd.city.generate import build_city, pave_ways
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.landuse.geojson import write_regions
from envgen_usd.landuse.regions import find_regions
from envgen_usd.landuse.write import write_landuse_map
from envgen_usd.layers.buildings import write_buildings
from envgen_usd.layers.landuse import write_landuse
from envgen_usd.layers.props import write_props
from envgen_usd.layers.roads import write_roads
from envgen_usd.layers.terrain import write_terrain
from envgen_usd.models.city import CityObject
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseMap, Plot
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import RoadSurface
from envgen_usd.terrain.ground import build_ground
from envgen_usd.terrain.write import write_heightmap

RECORD = "made.json"
"""File of a chunk that says from which inputs what was made; it is written last."""


@dataclass(frozen=True)
class ChunkInputs:
    """What all chunks are built from.

    Attributes:
        folder: Folder that holds one folder for each chunk.
        surface: The whole road.
        plots: All plots of the map.
        profile: The environment.
        catalogue: The asset library.
        seed: Of the build.
        metadata_only: Props have no geometry.
    """

    folder: Path
    surface: RoadSurface
    plots: tuple[Plot, ...]
    profile: Profile
    catalogue: Catalogue
    seed: int
    metadata_only: bool


def counts_of(folder: Path, chunk: Chunk, key: str) -> Mapping[str, int] | None:
    """What the chunk holds, or none if it is not there or was built from other inputs."""
    try:
        made = json.loads((folder / chunk.name / RECORD).read_text(encoding="utf-8"))
        return (
            {str(kind): int(n) for kind, n in made["counts"].items()}
            if made["key"] == key
            else None
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


@dataclass(frozen=True)
class ChunkMaps:
    """What one chunk is built from.

    Attributes:
        landuse: Landuse of the chunk.
        heightmap: Ground of the chunk.
        around: Ground of the chunks around it.
        buildings: Given buildings in the chunk and around it; none: they are generated.
    """

    landuse: LanduseMap
    heightmap: HeightMap
    around: tuple[HeightMap, ...]
    buildings: tuple[CityObject, ...] | None = None


def build_chunk(inputs: ChunkInputs, maps: ChunkMaps, key: str) -> Mapping[str, int]:
    """Writes all products of a chunk; an older folder of that chunk is replaced at the end.

    Args:
        inputs: What all chunks are built from.
        maps: What this chunk is built from.
        key: Hash of everything that the chunk follows from; kept with it.

    Returns:
        What was made: kind of feature to number.
    """
    name = maps.landuse.chunk.name
    final = inputs.folder / name
    work = Path(tempfile.mkdtemp(dir=inputs.folder, prefix=f".{name}."))
    work.chmod(0o755)
    try:
        counts = _write_products(inputs, maps, work)
        made = json.dumps({"key": key, "counts": counts}, indent=1)
        (work / RECORD).write_text(made + "\n", encoding="utf-8")
        if final.exists():
            (final / RECORD).unlink(
                missing_ok=True
            )  # Half a folder must not look like a whole one.
            shutil.rmtree(final)
        work.replace(final)
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        raise
    return counts


def _write_products(inputs: ChunkInputs, maps: ChunkMaps, work: Path) -> Mapping[str, int]:
    landuse, heightmap = maps.landuse, maps.heightmap
    chunk, profile, seed = landuse.chunk, inputs.profile, inputs.seed
    surface, catalogue = inputs.surface, inputs.catalogue
    if maps.buildings is None:
        landuse = pave_ways(chunk, inputs.plots, surface, heightmap, landuse, profile, seed)
    write_heightmap(heightmap, work / "heightmap.tif", surface.crs, surface.offset)
    write_landuse_map(landuse, work / "landuse.tif", surface.crs, surface.offset)
    regions = find_regions(landuse, inputs.plots, surface)
    write_regions(regions, work / "landuse.geojson", surface.crs, surface.offset)
    ground = build_ground(heightmap, surface, landuse)
    write_terrain(ground, work / "terrain.usdc")
    write_landuse(ground, landuse, profile, catalogue, work / "landuse.usdc")
    made = build_city(
        chunk,
        inputs.plots,
        surface,
        heightmap,
        landuse,
        profile,
        seed,
        maps.around,
        given=maps.buildings,
    )
    write_city(made, work / CITY_FILE)
    # The stage is made from what the file says, so that any other city model can take its place.
    city = read_city(work / CITY_FILE)
    write_roads(city, chunk, profile, catalogue, work / "roads.usdc")
    write_buildings(city, chunk, profile, catalogue, work / "buildings.usdc")
    props, only = work / "props.usdc", inputs.metadata_only
    write_props(city, chunk, profile, catalogue, seed, props, metadata_only=only)
    kinds = ("Building", "SolitaryVegetationObject", "CityFurniture", "TrafficSpace")
    return {kind: len(city.of_kind(kind)) for kind in kinds}


_shared: tuple[ChunkInputs, str]


def write_shared(inputs: ChunkInputs, path: Path) -> None:
    """Writes what all chunks are built from to a file, for `start_worker` alone."""
    with path.open("wb") as file:
        pickle.dump(inputs, file, pickle.HIGHEST_PROTOCOL)


def start_worker(path: Path, key: str) -> None:
    """Reads what all chunks of a worker process need, once."""
    global _shared  # noqa: PLW0603 - the state of a worker process
    with path.open("rb") as file:
        _shared = pickle.load(file), key


def build_in_worker(maps: ChunkMaps) -> Mapping[str, int]:
    """Builds a chunk in a process that `start_worker` has prepared."""
    inputs, key = _shared
    return build_chunk(inputs, maps, key)
