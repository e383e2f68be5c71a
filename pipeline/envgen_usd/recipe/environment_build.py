"""The table of contents of a build: from a road file to a composed stage, layer by layer."""

import tempfile
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.build_manifest import Manifest, manifest_issues, write_manifest
from envgen_usd.build_report import write_report
from envgen_usd.chunks import CITY_FILE, Chunk
from envgen_usd.city.roads.file_features import beyond_land
from envgen_usd.citygml.city_index import write_index
from envgen_usd.errors import Issue
from envgen_usd.executors.executor import ALONE, Executor, LocalProcesses, Tasks
from envgen_usd.folder_lock import locked
from envgen_usd.layers.lane_curves import LANE_TYPES
from envgen_usd.layers.parked_looks import missing_kinds, parked_looks
from envgen_usd.layers.stage_composition import compose_stage
from envgen_usd.layers.traffic_sublayer import keep_traffic
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.opendrive.inspect.map_drawing import write_map
from envgen_usd.output_folder import (
    DRAWING_FILE,
    REPORT_FILE,
    create_folder,
    remove_other_chunks,
    remove_unfinished,
    remove_unfinished_chunks,
    withdraw_stage,
)
from envgen_usd.recipe.build_inputs import read_inputs
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.build_summary import bounded, option_values, total_counts
from envgen_usd.recipe.chunk_products import (
    ChunkInputs,
    ChunkMaps,
    build_chunk,
    build_in_worker,
    start_worker,
    streets_have_actors,
    write_shared,
)
from envgen_usd.recipe.chunk_summaries import kept_entry, kept_payload
from envgen_usd.recipe.given_place import GivenPlace, read_given_place
from envgen_usd.recipe.lanelet_place import LaneletPlace
from envgen_usd.recipe.map_land import (
    Land,
    gives_land,
    input_files,
    lay_out_land,
    read_road_file,
)
from envgen_usd.recipe.mapped_place import MappedPlace
from envgen_usd.recipe.product_files import damage_issues, product_hashes
from envgen_usd.recipe.regional_build import (
    ChunkContext,
    build_region_chunks,
    lay_out_regions,
    regional_map,
    remove_regions,
)
from envgen_usd.recipe.unchanged_chunks import (
    ChunkRecord,
    content_hashes,
    input_key,
    kept_record,
    library_versions,
)
from envgen_usd.recipe.unknown_signs import unknown_signs
from envgen_usd.render.frames.stage_cameras import NAME as CAMERAS
from envgen_usd.render.frames.stage_cameras import write_stage_cameras
from envgen_usd.step_clock import Clock, Progress
from envgen_usd.whole_files import temporary_folder


@dataclass(frozen=True)
class BuildResult:
    """Products and statistics of a build.

    Attributes:
        stage: The composed stage.
        manifest: Inputs, products and times.
        issues: Warnings about the road file and its geometry, and parts of buildings without room.
        counts: Kind of feature to number of features, over all chunks.
        built: Number of chunks that this build wrote.
        kept: Number of unchanged chunks.
    """

    stage: Path
    manifest: Manifest
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]
    built: int
    kept: int


@dataclass(frozen=True)
class ShardResult:
    """Chunks of a part of a build.

    Attributes:
        built: Number of chunks that this run wrote.
        kept: Number of unchanged chunks.
    """

    built: int
    kept: int


def build(options: BuildOptions, progress: Progress = lambda *_: None) -> BuildResult:
    """Builds an environment.

    A chunk with unchanged inputs is kept, so an interrupted build resumes. Unfinished output of
    killed builds is removed.

    Raises:
        EnvgenError: An input is unusable, and no file has been written; or another process builds
            into the same folder.
    """
    profile, catalogue = read_inputs(options)
    clock = Clock(progress)
    place = read_given_place(options, clock)
    with locked(options.out), _begun(options, place) as executor:
        return _build_in_folder(options, profile, catalogue, clock, place, executor)


def _begun(options: BuildOptions, place: GivenPlace | None) -> AbstractContextManager[Executor]:
    """The executor; for a map, its processes start while this one still reads the roads."""
    executor = options.tasks_executor()
    if isinstance(place, MappedPlace):
        return executor.begun("envgen_usd.recipe.chunk_products")
    return nullcontext(executor)


def _laid_out(  # noqa: PLR0913, PLR0917 - what land follows from
    options: BuildOptions,
    profile: Profile,
    clock: Clock,
    place: GivenPlace | None,
    executor: Executor,
    shard: tuple[int, int] = (1, 1),
) -> tuple[BuildOptions, Land]:
    """The land, and the options with the road file of a map, which is written last of all."""
    if place is None:
        return options, _lay_out(options, profile, clock, shard)
    local = executor if isinstance(executor, LocalProcesses) else ALONE
    with tempfile.TemporaryDirectory() as folder:
        # An unusable city model is noticed here, before the output folder has any file.
        draft = replace(options, road=place.write_road(Path(folder)))
        if isinstance(place, LaneletPlace):
            land = lay_out_land(draft, profile, clock)
            files = {**land.files, "lanelet2": (place.file,)}
            land = replace(land, issues=(*place.issues, *land.issues), files=files)
        else:
            land = lay_out_land(draft, profile, clock, place, executor=local)
    road = place.write_road(create_folder(options.out))
    return replace(options, road=road), replace(land, files={**land.files, "road": (road,)})


def build_shard(
    options: BuildOptions, shard: tuple[int, int], progress: Progress = lambda *_: None
) -> ShardResult:
    """Builds a part of the chunks of an environment, and no stage.

    Several shards may run at a time, on machines that share the output folder. `build` keeps their
    chunks and composes the stage. A chunk is the same as in a build of all.

    Args:
        options: Options of the build; the same for all shards.
        shard: i and n; part i of n parts.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: An input is unusable; or another process builds this shard, or the whole.
    """
    profile, catalogue = read_inputs(options)
    clock, (number, count) = Clock(progress), shard
    own = options.out / "chunks" / f".shard_{number}_of_{count}"
    place = read_given_place(options, clock)
    with locked(options.out, shared=True), locked(own), _begun(options, place) as executor:
        options, land = _laid_out(options, profile, clock, place, executor, shard)
        folder = create_folder(options.out)
        is_part = land.regional is not None and len(land.regional.land.regions.all) >= count
        part = land.chunks if is_part else land.chunks[number - 1 :: count]
        remove_unfinished_chunks(folder, part)
        plan = _Plan.of(options, profile, catalogue, land, part, clock)
        built = _built(plan, options, executor, clock)
        return ShardResult(len(built), len(part) - len(plan.missing))


def _lay_out(
    options: BuildOptions,
    profile: Profile,
    clock: Clock,
    shard: tuple[int, int],
) -> Land:
    """Lays out the land of a map, region by region where it is large.

    Args:
        options: Options of the build.
        profile: The environment.
        clock: Takes the time of each step.
        shard: i and n; of a map with at least n regions, those of part i of n parts are laid out.
    """
    if gives_land(options):
        return lay_out_land(options, profile, clock)
    with clock.step("file"):
        road = read_road_file(options.road, options.tolerance, profile.road.kerb_height)
    regional = regional_map(options, profile, road)
    if regional is None:
        return lay_out_land(options, profile, clock, road=road)
    key = _keys(options, input_files(options, profile, road))[2]
    return lay_out_regions(regional.part(shard), options, key, clock)


def _keys(
    options: BuildOptions, files: Mapping[str, tuple[Path, ...]]
) -> tuple[Mapping[str, Mapping[str, str]], Mapping[str, str], str]:
    """Hashes of the input files, versions of the libraries, and the hash of all inputs."""
    hashes, versions = content_hashes(options, files), library_versions(options)
    return hashes, versions, input_key(options, hashes, versions)


@dataclass(frozen=True)
class _Plan:
    """What is built, and what is kept.

    Attributes:
        land: Roads, landuse and terrain of the map.
        catalogue: The asset library.
        inputs: Inputs shared by all chunks; `None` where each region has its own.
        hashes: Hashes of the input files.
        versions: Versions of the libraries.
        key: Hash of all inputs.
        kept: Records of unchanged chunks.
        missing: Chunks that have to be built.
        damages: Issues of chunks that were damaged after a build of these inputs.
    """

    land: Land
    catalogue: Catalogue
    inputs: ChunkInputs | None
    hashes: Mapping[str, Mapping[str, str]]
    versions: Mapping[str, str]
    key: str
    kept: Sequence[ChunkRecord]
    missing: Sequence[Chunk]
    damages: Sequence[Issue]

    @staticmethod
    def of(  # noqa: PLR0913, PLR0917 - what a build follows from
        options: BuildOptions,
        profile: Profile,
        catalogue: Catalogue,
        land: Land,
        chunks: Sequence[Chunk],
        clock: Clock,
    ) -> "_Plan":
        """Compares the inputs with those of the chunks in the output folder."""
        folder = options.out.absolute() / "chunks"
        inputs = None
        if land.regional is None:
            with clock.step("index"):
                inputs = ChunkInputs.of(folder, land, profile, catalogue, options)
        hashes, versions, key = _keys(options, land.files)
        looks = {chunk: kept_record(folder, chunk, key) for chunk in chunks}
        kept = [record for record, _ in looks.values() if record is not None]
        missing = [chunk for chunk, (record, _) in looks.items() if record is None]
        damages = [issue for _, issues in looks.values() for issue in issues]
        return _Plan(land, catalogue, inputs, hashes, versions, key, kept, missing, damages)


def _built(
    plan: _Plan, options: BuildOptions, executor: Executor, clock: Clock
) -> list[ChunkRecord]:
    folder, regional = options.out.absolute() / "chunks", plan.land.regional
    if plan.missing:
        withdraw_stage(folder.parent)
    with clock.step("chunks", len(plan.missing)):
        if plan.inputs is not None:
            jobs = [plan.land.of(chunk) for chunk in plan.missing]
            return build_chunks(plan.inputs, jobs, plan.key, executor, clock.progress)
        if regional is None or not plan.missing:
            return []
        context = ChunkContext(folder, regional.land, plan.catalogue, options, plan.key)
        return build_region_chunks(regional, context, plan.missing, clock.progress)


def _build_in_folder(  # noqa: PLR0913, PLR0917 - what a build follows from
    options: BuildOptions,
    profile: Profile,
    catalogue: Catalogue,
    clock: Clock,
    place: GivenPlace | None,
    executor: Executor,
) -> BuildResult:
    options, land = _laid_out(options, profile, clock, place, executor)
    folder = create_folder(options.out)
    remove_unfinished(folder)
    plan = _Plan.of(options, profile, catalogue, land, land.chunks, clock)
    chunks, damages = folder / "chunks", (*plan.damages, *damage_issues(folder))
    has_actors = streets_have_actors(profile, options)
    placed = land.surface.features
    lost = (*beyond_land(placed, frozenset(land.chunks)), *unknown_signs(placed, catalogue))
    absent = missing_kinds(profile, parked_looks(profile, catalogue)) if has_actors else ()
    issues = (*land.issues, *lost, *absent, *manifest_issues(folder), *damages)
    records = [*_built(plan, options, executor, clock), *plan.kept]
    counts = total_counts(records)
    issues = (*issues, *bounded(issue for record in records for issue in record.issues))
    with clock.step("stage"):
        withdraw_stage(folder)
        remove_other_chunks(chunks, land.chunks)
        stage = _composed(land, options, profile, catalogue, folder)
        issues = (*issues, *keep_traffic(folder))
    remove_regions(folder)
    products, chosen = product_hashes(folder, land.chunks), option_values(options)
    keys = {chunk.name: plan.key for chunk in land.chunks}
    manifest = Manifest(chosen, plan.hashes, plan.versions, products, keys, clock.seconds)
    write_manifest(manifest, folder)
    write_map(land.network, folder / DRAWING_FILE, profile.road.marks)
    report, words = folder / REPORT_FILE, profile.description
    write_report(report, manifest, counts, issues, DRAWING_FILE, environment=words)
    return BuildResult(stage, manifest, issues, counts, len(plan.missing), len(plan.kept))


def _composed(
    land: Land, options: BuildOptions, profile: Profile, catalogue: Catalogue, folder: Path
) -> Path:
    """Composes the stage and the index of the city from the chunks; returns the stage's file."""
    write_stage_cameras(folder, driving_lanes(land.surface))
    stage = compose_stage(
        folder,
        land.chunks,
        land.surface,
        profile,
        catalogue,
        options.embed_assets,
        options.seed,
        (CAMERAS,),
        read=kept_payload,
        actors=streets_have_actors(profile, options),
    )
    cities = [folder / "chunks" / chunk.name / CITY_FILE for chunk in land.chunks]
    write_index(cities, folder / CITY_FILE, kept_entry)
    return stage


def driving_lanes(surface: RoadSurface) -> list[FloatArray]:
    """Centre lines of lanes for cars, N_i x 3, metres; of those outside of junctions, if any."""
    lanes = [lane for lane in surface.lanes if lane.lane_type in LANE_TYPES]
    outside = [lane for lane in lanes if not lane.junction]
    return [lane.points for lane in outside or lanes]


def build_chunks(
    inputs: ChunkInputs, jobs: Sequence[ChunkMaps], key: str, executor: Executor, progress: Progress
) -> list[ChunkRecord]:
    """Builds chunks in parallel.

    Returns:
        Record of each chunk, in the order of completion.
    """
    records: list[ChunkRecord] = []

    def add(record: ChunkRecord) -> None:
        records.append(record)
        progress("chunks", len(records), len(jobs))

    if executor.is_alone(len(jobs)):
        for job in jobs:
            add(build_chunk(inputs, job, key))
        return records
    try:
        with temporary_folder(inputs.folder, ".shared.") as folder:
            shared = folder / "inputs.pickle"
            write_shared(inputs, shared)
            executor.run(Tasks(build_in_worker, jobs, start_worker, (shared, key)), add)
    except BaseException:
        remove_unfinished_chunks(inputs.folder.parent, [job.landuse.chunk for job in jobs])
        raise
    return records
