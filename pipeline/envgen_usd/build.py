"""The table of contents of a build: from a road file to a composed stage, layer by layer."""

import os
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata, resources
from itertools import chain
from pathlib import Path

from envgen_usd.chunk_job import (
    ChunkInputs,
    ChunkMaps,
    build_chunk,
    build_in_worker,
    counts_of,
    start_worker,
    write_shared,
)
from envgen_usd.chunks import CITY_FILE, Chunk
from envgen_usd.citygml.index import write_index
from envgen_usd.clock import Clock, Progress
from envgen_usd.config import BuildOptions
from envgen_usd.errors import Issue
from envgen_usd.inputs import read_inputs
from envgen_usd.land import landuse_file, lay_out_land, terrain_file
from envgen_usd.layers.stage import compose_stage
from envgen_usd.manifest import Manifest, hash_bytes, hash_files, hash_folder, write_manifest
from envgen_usd.opendrive.map_drawing import write_map
from envgen_usd.output import create_folder, remove_other_chunks, remove_unfinished
from envgen_usd.profiles import profile_path
from envgen_usd.report import write_report
from envgen_usd.workers import run_in_workers


@dataclass(frozen=True)
class BuildResult:
    """What a build made.

    Attributes:
        stage: The composed stage.
        manifest: Inputs, products and times.
        issues: What was odd in the road file and in its geometry.
        counts: Kind of feature to number, over all chunks.
        built: Chunks that were built now.
        kept: Chunks whose inputs had not changed.
    """

    stage: Path
    manifest: Manifest
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]
    built: int
    kept: int


def build(options: BuildOptions, progress: Progress = lambda *_: None) -> BuildResult:
    """Builds an environment.

    A chunk that was built before from the same inputs is kept, so an interrupted build goes on
    where it stopped.

    Raises:
        EnvgenError: Something in the input cannot be used; nothing has been written then.
    """
    clock = Clock(progress)
    profile, catalogue = read_inputs(options)
    land = lay_out_land(options, profile, clock)
    folder = create_folder(options.out)
    whole = (land.surface, land.plots, profile, catalogue)
    inputs = ChunkInputs(folder / "chunks", *whole, options.seed, options.metadata_only)
    key = input_key(options)
    kept = {chunk: counts_of(inputs.folder, chunk, key) for chunk in land.chunks}
    jobs = [land.of(chunk) for chunk, made in kept.items() if made is None]
    with clock.step("chunks", len(jobs)):
        counts = build_chunks(inputs, jobs, key, options.workers, progress)
    for made in kept.values():
        counts.update(made or {})
    with clock.step("stage"):
        remove_other_chunks(inputs.folder, land.chunks)
        embed = options.embed_assets
        stage = compose_stage(folder, land.chunks, land.surface, profile, catalogue, embed)
        cities = [inputs.folder / chunk.name / CITY_FILE for chunk in land.chunks]
        write_index(cities, folder / CITY_FILE)
    manifest = make_manifest(options, folder, land.chunks, key, clock.seconds)
    write_manifest(manifest, folder)
    write_map(land.network, folder / "map.svg")
    write_report(folder / "report.html", manifest, counts, land.issues, "map.svg")
    return BuildResult(stage, manifest, land.issues, counts, len(jobs), len(kept) - len(jobs))


def input_key(options: BuildOptions) -> str:
    """Hash of everything that the content of a chunk follows from."""
    package = Path(str(resources.files("envgen_usd")))
    library = options.library or Path(str(resources.files("envgen_usd.asset_library")))
    environment = profile_path(options.country, options.area, options.environments_folder())
    heights = terrain_file(options)
    landuse = landuse_file(options)
    return hash_bytes(
        options.road.read_bytes(),
        environment.read_bytes(),
        repr((options.seed, options.tolerance, options.metadata_only)),
        "" if options.embed_assets else str(library.absolute()),
        options.landuse,
        landuse.read_bytes() if landuse else b"",
        heights.read_bytes() if heights else b"",
        options.city.read_bytes() if options.city else b"",
        hash_folder(package, "*.py"),
        hash_folder(library, "*.usda", "*.usdc", "*.toml"),
    )


def build_chunks(
    inputs: ChunkInputs, jobs: Sequence[ChunkMaps], key: str, workers: int, progress: Progress
) -> Counter[str]:
    """Builds chunks, spread over processes.

    Returns:
        Number of features by kind.
    """
    counts: Counter[str] = Counter()
    done = 0

    def add(made: Mapping[str, int]) -> None:
        nonlocal done
        done += 1
        counts.update(made)
        progress("chunks", done, len(jobs))

    count = min(workers or os.cpu_count() or 1, len(jobs))
    if count <= 1:
        for job in jobs:
            add(build_chunk(inputs, job, key))
        return counts
    try:
        with tempfile.TemporaryDirectory(dir=inputs.folder, prefix=".shared.") as folder:
            shared = Path(folder) / "inputs.pickle"
            write_shared(inputs, shared)
            run_in_workers(build_in_worker, jobs, count, start_worker, (shared, key), add)
    except BaseException:
        remove_unfinished(inputs.folder)
        raise
    return counts


def make_manifest(
    options: BuildOptions,
    folder: Path,
    chunks: Sequence[Chunk],
    key: str,
    seconds: Mapping[str, float],
) -> Manifest:
    """Collects inputs, versions and the hashes of all products."""
    inputs = {
        "road": options.road.name,
        "road_sha256": hash_bytes(options.road.read_bytes()),
        **{name: str(getattr(options, name)) for name in ("country", "area", "landuse")},
        "heightmap": str(options.heightmap or ""),
        "terrain_network": str(options.terrain_network or ""),
        "city": str(options.city or ""),
        "seed": options.seed,
        "tolerance": options.tolerance,
        "metadata_only": options.metadata_only,
    }
    versions = {name: metadata.version(name) for name in ("envgen-usd", "usd-core", "numpy")}
    places = [folder.glob("*"), *((folder / part).rglob("*") for part in PARTS)]
    files = [path for path in chain(*places) if path.is_file() and path.suffix in SUFFIXES]
    keys = {chunk.name: key for chunk in chunks}
    return Manifest(inputs, versions, hash_files(files, folder), keys, seconds)


PARTS = ("assets", "chunks", "layers", "materials", "textures")
SUFFIXES = {".usda", ".usdc", ".tif", ".gml", ".geojson"}
"""Folders and kinds of the products that the manifest lists; images of a stage are none."""
