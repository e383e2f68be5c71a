"""The table of contents of a build: from a road file to a composed stage, layer by layer."""

import multiprocessing
import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import metadata, resources
from pathlib import Path

from envgen_usd.assets.catalogue import read_catalogue
from envgen_usd.chunk_job import (
    ChunkInputs,
    ChunkMaps,
    build_chunk,
    build_in_worker,
    is_built,
    start_worker,
)
from envgen_usd.chunks import CITY_FILE, Chunk, chunks_of_points
from envgen_usd.citygml.index import write_index
from envgen_usd.config import BuildOptions
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.geometry.georeference import check_crs
from envgen_usd.given_city import read_given_city
from envgen_usd.landuse.plots import find_plots
from envgen_usd.landuse.provider import LanduseProvider
from envgen_usd.landuse.read import read_given_landuse
from envgen_usd.landuse.rules import RuleProvider
from envgen_usd.layers.stage import compose_stage
from envgen_usd.manifest import (
    Manifest,
    hash_bytes,
    hash_files,
    hash_folder,
    read_manifest,
    write_manifest,
)
from envgen_usd.models.profile import PlotRules
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.surface import RoadSurface
from envgen_usd.opendrive.furniture import place_furniture
from envgen_usd.opendrive.map_drawing import write_map
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.profiles import environments_folder, read_profile
from envgen_usd.report import write_report
from envgen_usd.terrain.checks import find_steep_ground
from envgen_usd.terrain.heightmap import build_heightmaps
from envgen_usd.terrain.read import read_dem

BEYOND = 25.0
"""Land behind the deepest plots that is built at least, metres, so that none ends in the void."""

Progress = Callable[[str, int, int], None]
"""Called with the step's name, what is done of it, and how much there is."""


@dataclass(frozen=True)
class BuildResult:
    """What a build made.

    Attributes:
        stage: The composed stage.
        manifest: Inputs, products and times.
        issues: What was odd in the road file and in its geometry.
        counts: Kind of feature to number, over the chunks that were built now.
        built: Chunks that were built now.
        kept: Chunks whose inputs had not changed.
    """

    stage: Path
    manifest: Manifest
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]
    built: int
    kept: int


class _Clock:
    """Wall time by step."""

    def __init__(self, progress: Progress) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        self._progress(name, 0, 1)
        start = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - start, 3)
        self._progress(name, 1, 1)


def build(options: BuildOptions, progress: Progress = lambda *_: None) -> BuildResult:
    """Builds an environment.

    A chunk that was built before from the same inputs is kept, so an interrupted build goes on
    where it stopped.

    Raises:
        EnvgenError: Something in the input cannot be used; nothing has been written then.
    """
    clock = _Clock(progress)
    profile = read_profile(options.country, options.area, options.environments)
    check_output(options.out)
    with clock.step("road"):
        network, surface = read_road(options.road, options.tolerance)
    chunks = chunks_of_points(surface.vertices, land_beside(profile.plots))
    with clock.step("landuse"):
        provider = landuse_provider(options.landuse, surface)
        maps = provider.generate(surface, chunks, profile, options.seed)
        plots = find_plots(maps, surface)
    with clock.step("terrain"):
        rules = profile.terrain
        base = read_dem(options.heightmap, surface) if options.heightmap else None
        heightmaps = build_heightmaps(surface, chunks, rules, options.seed, base, plots)
        steep = find_steep_ground(heightmaps, surface, rules)
    given = read_given_city(options.city, surface, chunks) if options.city else None
    folder = create_folder(options.out)
    catalogue = read_catalogue(options.library, embed=options.embed_assets)
    whole = (surface, plots, profile, catalogue)
    inputs = ChunkInputs(folder / "chunks", *whole, options.seed, options.metadata_only)
    key = input_key(options)
    jobs = [
        ChunkMaps(
            maps[chunk],
            heightmaps[chunk],
            tuple(heightmaps[near] for near in chunk.neighbours() if near in heightmaps),
            given.around(chunk) if given else None,
        )
        for chunk in chunks
        if not is_built(inputs.folder, chunk, key)
    ]
    with clock.step("chunks"):
        counts = build_chunks(inputs, jobs, key, options.workers, progress)
    with clock.step("stage"):
        remove_other_chunks(inputs.folder, chunks)
        stage = compose_stage(folder, chunks, surface, profile, catalogue, options.embed_assets)
        cities = [folder / "chunks" / chunk.name / CITY_FILE for chunk in chunks]
        write_index(cities, folder / CITY_FILE)
    manifest = make_manifest(options, folder, chunks, key, clock.seconds)
    write_manifest(manifest, folder)
    issues = (*network.issues, *surface.issues, *check_crs(surface.crs), *steep)
    write_map(network, folder / "map.svg")
    write_report(folder / "report.html", manifest, counts, issues, "map.svg")
    return BuildResult(stage, manifest, issues, counts, len(jobs), len(chunks) - len(jobs))


def land_beside(plots: PlotRules) -> float:
    """Width of the land beside the road that an environment needs, metres."""
    return plots.verge[1] + plots.rows * plots.depth[1] + BEYOND


def read_road(path: Path, tolerance: float) -> tuple[RoadNetwork, RoadSurface]:
    """Reads an OpenDRIVE file and turns it into a surface with what stands beside it.

    Raises:
        EnvgenError: The file cannot be used.
    """
    network = read_network(path)
    surface = build_surface(network, tolerance)
    furniture = (*surface.furniture, *place_furniture(network))
    return network, replace(surface, furniture=furniture)


def landuse_provider(choice: str, surface: RoadSurface) -> LanduseProvider:
    """Returns what makes the landuse: ``rules``, or a raster that is read.

    Raises:
        EnvgenError: The choice is neither, or the raster cannot be used.
    """
    if choice == "rules":
        return RuleProvider()
    if not Path(choice).is_file():
        raise EnvgenError(f"--landuse {choice}: is neither 'rules' nor a file")
    return read_given_landuse(Path(choice), surface)


def check_output(out: Path) -> None:
    """Makes sure that a folder can take an environment without anything being lost.

    Raises:
        EnvgenError: It is a file, cannot be written, or holds something else.
    """
    if out.exists() and not out.is_dir():
        raise EnvgenError(f"{out}: is a file; choose a folder for --out")
    if out.is_dir() and any(out.iterdir()) and not (out / "chunks").is_dir():
        raise EnvgenError(f"{out}: holds other files; choose an empty or a new folder for --out")
    read_manifest(out)
    parent = next(p for p in (out, *out.absolute().parents) if p.exists())
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        raise EnvgenError(f"{out}: cannot be written; choose a folder of yours for --out")


def create_folder(out: Path) -> Path:
    """Makes the folders of an environment and returns its absolute path."""
    try:
        (out / "chunks").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvgenError(
            f"{out}: cannot be made ({error.strerror}); choose another --out"
        ) from error
    return out.absolute()


def input_key(options: BuildOptions) -> str:
    """Hash of everything that the content of a chunk follows from."""
    package = Path(str(resources.files("envgen_usd")))
    library = options.library or Path(str(resources.files("envgen_usd.asset_library")))
    environments = options.environments or environments_folder()
    heightmap = options.heightmap.read_bytes() if options.heightmap else b""
    return hash_bytes(
        options.road.read_bytes(),
        (environments / f"country_{options.country}" / f"{options.area}.toml").read_bytes(),
        repr((options.seed, options.tolerance, options.metadata_only)),
        "" if options.embed_assets else str(library.absolute()),
        options.landuse,
        Path(options.landuse).read_bytes() if options.landuse != "rules" else b"",
        heightmap,
        options.city.read_bytes() if options.city else b"",
        hash_folder(package, "*.py"),
        hash_folder(library, "*.usda", "*.usdc", "*.toml"),
    )


def build_chunks(
    inputs: ChunkInputs, jobs: Sequence[ChunkMaps], key: str, workers: int, progress: Progress
) -> Mapping[str, int]:
    """Builds chunks, spread over processes.

    Returns:
        Number of features by kind.
    """
    counts: Counter[str] = Counter()
    count = min(workers or os.cpu_count() or 1, len(jobs))
    if count <= 1:
        for done, job in enumerate(jobs):
            progress("chunks", done, len(jobs))
            counts.update(build_chunk(inputs, job, key))
        return counts
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, context, start_worker, (inputs, key)) as pool:
        futures = [pool.submit(build_in_worker, job) for job in jobs]
        try:
            for done, future in enumerate(as_completed(futures)):
                progress("chunks", done, len(jobs))
                counts.update(future.result())
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return counts


def remove_other_chunks(folder: Path, chunks: Sequence[Chunk]) -> None:
    """Removes the folders of chunks that an earlier build of another road left."""
    names = {chunk.name for chunk in chunks}
    for path in folder.iterdir():
        if path.name not in names:
            shutil.rmtree(path)


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
        "city": str(options.city or ""),
        "seed": options.seed,
        "tolerance": options.tolerance,
    }
    versions = {name: metadata.version(name) for name in ("envgen-usd", "usd-core", "numpy")}
    files = [path for path in folder.rglob("*") if path.is_file() and path.suffix in SUFFIXES]
    keys = {chunk.name: key for chunk in chunks}
    return Manifest(inputs, versions, hash_files(files, folder), keys, seconds)


SUFFIXES = {".usda", ".usdc", ".tif", ".gml"}
"""Products that the manifest lists."""
