"""The table of contents of a data set: towns, frames, index, sheets, report."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd import __version__
from envgen_usd.build_manifest import write_manifest
from envgen_usd.build_report import write_report
from envgen_usd.compressed_files import content_stem
from envgen_usd.datasets.dataset_index import IndexedFrame, write_index
from envgen_usd.datasets.formats.dataset_formats import FORMATS, check_formats, write_formats
from envgen_usd.datasets.pages.dataset_report import RoadMap, write_dataset_report
from envgen_usd.datasets.pages.preview_sheets import draw_previews
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.executors.executor import Cluster, Executor, Tasks
from envgen_usd.folder_lock import locked
from envgen_usd.layers.traffic_sublayer import SUBLAYER
from envgen_usd.output_folder import DRAWING_FILE, REPORT_FILE, STAGE_FILE, refuse_build
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.dataset_files import drop_damaged, write_file_list, write_shard_list
from envgen_usd.recipe.dataset_plan import Block, Take, Town, files_of, shard_of, takes_of
from envgen_usd.recipe.dataset_recipe import (
    DatasetRecipe,
    read_recipe,
    recipe_files,
    recipe_mark,
    recipe_values,
)
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.street_splits import Streets, share_streets
from envgen_usd.recipe.traffic_build import add_traffic, simulated
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_folder import read_table
from envgen_usd.render.frames.frame_light import LightChoice
from envgen_usd.render.frames.rig_folder import RigFolder
from envgen_usd.render.frames.scan_export import rig_models
from envgen_usd.render.trajectories.trajectory import Trajectory
from envgen_usd.step_clock import Progress
from envgen_usd.traffic.traces.sumo_run import SumoOptions
from envgen_usd.whole_files import remove_abandoned, write_whole

MARK = "dataset.json"
"""File that says which recipe the folder holds."""
_ROUNDS = 2
"""Rounds of drawing: a town that is built anew may end frames of before, which are drawn then."""
_MOST = 100
"""Largest number of frames that a process draws at once; a larger value reads towns less often and
shares work less evenly."""


@dataclass(frozen=True)
class DatasetResult:
    """Statistics of a data set's run.

    Attributes:
        towns: Number of towns that were built or checked.
        rendered: Frames of the vehicle that this run drew.
        kept: Frames of earlier runs.
        frames: All frames of all cameras; empty for a shard.
        issues: Warnings of builds and frames.
    """

    towns: int
    rendered: int
    kept: int
    frames: tuple[IndexedFrame, ...]
    issues: tuple[Issue, ...]


@dataclass(frozen=True)
class _Drawn:
    """What was drawn.

    Attributes:
        asked: Frames that were asked for.
        frames: Those of them that were missing.
        removed: Files of other stages that were removed.
        issues: Warnings.
        folders: Beginnings of the paths of their files.
    """

    asked: int = 0
    frames: int = 0
    removed: int = 0
    issues: tuple[Issue, ...] = ()
    folders: tuple[str, ...] = ()

    def __add__(self, other: "_Drawn") -> "_Drawn":
        """Both together."""
        return _Drawn(
            self.asked + other.asked,
            self.frames + other.frames,
            self.removed + other.removed,
            (*self.issues, *other.issues),
            (*self.folders, *other.folders),
        )


@dataclass(frozen=True)
class _Job:
    """Frames that a process draws."""

    recipe: DatasetRecipe
    folder: Path
    block: Block


def make_dataset(  # noqa: PLR0913 - what a run follows from
    source: Path,
    out: Path,
    *,
    shard: tuple[int, int] = (1, 1),
    formats: Sequence[str] = (),
    cluster: Cluster = Cluster(workers=1),  # noqa: B008 - is frozen
    progress: Progress = lambda *_: None,
) -> DatasetResult:
    """Makes a data set from its recipe: builds what is missing, draws, writes index and report.

    What is finished is kept, so the same call goes on after an interruption.

    Args:
        source: Recipe, a TOML file.
        out: Folder of the data set.
        shard: i and n: only part i of n parts of the frames; `merge_shards` finishes.
        formats: Layouts that are written besides those of the recipe.
        cluster: Who builds chunks and draws frames.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The recipe or a file that it names cannot be used, the folder holds frames of
            another recipe, no cluster answers, or a file cannot be written.
    """
    recipe = with_formats(read_recipe(source), formats)
    streets = share_streets(recipe, source)
    executor = cluster.executor(out.absolute() / ".jobs")
    open_dataset(out, recipe)
    takes = takes_of(recipe)
    asked = shard_of(takes, shard)
    known, damages = drop_damaged(out, files_of(asked))
    made, towns = _made(out, recipe, asked, cluster, executor, progress)
    known = {name: value for name, value in known.items() if not name.startswith(made.folders)}
    kept = max(sum(len(block.numbers) for block in asked) - made.frames, 0)
    if shard[1] == 1:
        frames = finish_dataset(out, recipe, streets, progress, known)
    else:
        frames = ()
        write_shard_list(out, known, files_of(asked))
    issues = tuple(dict.fromkeys((*damages, *made.issues, *_earlier_formats(out, recipe))))
    return DatasetResult(towns, made.frames, kept, frames, issues)


def _made(  # noqa: PLR0913, PLR0917 - what frames follow from
    out: Path,
    recipe: DatasetRecipe,
    asked: Sequence[Block],
    cluster: Cluster,
    executor: Executor,
    progress: Progress,
) -> tuple[_Drawn, int]:
    """Builds towns and draws what is missing; returns what was drawn, and the number of towns."""
    made, towns = _Drawn(), set[Town]()
    for _ in range(_ROUNDS):
        missing = [block for each in asked if (block := _missing(out, recipe, each)).numbers]
        found = list(dict.fromkeys(block.take.town for block in missing))
        for number, town in enumerate(found):
            progress("build towns", number, len(found))
            made += _Drawn(issues=tuple(_build_town(out, town, recipe, cluster)))
        progress("build towns", len(found), len(found))
        drawn = _draw(out, recipe, missing, executor, progress)
        made, towns = made + drawn, towns | set(found)
        if not drawn.removed:
            break
    return made, len(towns)


def _earlier_formats(out: Path, recipe: DatasetRecipe) -> list[Issue]:
    """Issues of layouts that an earlier run wrote, and that nobody asks for any more."""
    text, action = "a layout that this run was not asked for", "may show other frames; remove it"
    return [
        Issue("dataset.earlier_format", Severity.WARNING, name, text, action)
        for name in FORMATS
        if name not in recipe.formats and (out / name).is_dir()
    ]


def with_formats(recipe: DatasetRecipe, formats: Sequence[str]) -> DatasetRecipe:
    """A recipe with more formats.

    Raises:
        EnvgenError: A format is unknown, or needs another output.
    """
    try:
        check_formats(formats, recipe.outputs, recipe.lidar_format)
    except EnvgenError as error:
        raise EnvgenError(f"--format: {error}") from error
    return replace(recipe, formats=tuple(dict.fromkeys((*recipe.formats, *formats))))


def open_dataset(out: Path, recipe: DatasetRecipe) -> None:
    """Marks a folder with its recipe.

    Raises:
        EnvgenError: The folder holds frames of another recipe or a build, or cannot be written.
    """
    refuse_build(out)
    mark, files, path = recipe_mark(recipe), recipe_files(recipe), out / MARK
    values = json.loads(json.dumps(recipe_values(recipe)))
    with locked(out, wait=True):
        earlier = read_table(path)
        if not earlier and (out / "frames").exists():
            raise EnvgenError(f"{out}: holds frames of no known recipe; choose another --out")
        if earlier.get("recipe_sha256", mark) != mark:
            raise EnvgenError(
                f"{path}: {_difference(earlier, values, files)}; choose another --out"
            )
        content = {"recipe_sha256": mark, "version": __version__, "files": files, "recipe": values}
        write_whole(path, json.dumps(content, indent=1) + "\n")
        remove_abandoned(out)


def _difference(
    earlier: Mapping[str, Any], values: Mapping[str, Any], files: Mapping[str, str]
) -> str:
    """What distinguishes a folder's recipe from another recipe."""
    before = earlier.get("recipe", {})
    for key, value in values.items():
        if before.get(key) != value:
            return f"holds another recipe's frames: {key} is {before.get(key)!r}, not {value!r}"
    if earlier.get("version") != __version__:
        return f"holds frames of version {earlier.get('version')}"
    known = earlier.get("files", {})
    other = ", ".join(name for name, value in files.items() if known.get(name) != value)
    return f"holds another recipe's frames: {other or 'a file'} had another content"


def finish_dataset(
    out: Path,
    recipe: DatasetRecipe,
    streets: dict[str, Streets],
    progress: Progress = lambda *_: None,
    known: Mapping[str, str] | None = None,
) -> tuple[IndexedFrame, ...]:
    """Writes index, sheets, report and list of files of a complete data set.

    Args:
        out: Folder of the data set.
        recipe: The recipe.
        streets: Streets of each road, with their splits.
        progress: Called with the step's name, the parts done and the total.
        known: Hashes of files that are known to be whole, by their path.

    Raises:
        EnvgenError: Frames are missing, or a file cannot be written.
    """
    takes = takes_of(recipe)
    lacking = [_missing(out, recipe, block) for block in shard_of(takes, (1, 1))]
    number = sum(len(block.numbers) for block in lacking)
    if number:
        first = next(block for block in lacking if block.numbers)
        place = f"{first.take.folder}, frame {first.numbers[0]}"
        total = sum(take.frames for take in takes)
        fault = f"{number} of {total} frames are missing"
        raise EnvgenError(f"{out}: {fault}, the first is {place}; run the shards to their end")
    frames = tuple(row for take in takes for row in _rows(out, take, streets))
    write_index(out, frames, recipe.splits)
    sheets = draw_previews(out, frames, progress=progress)
    roads = [_map_of(name, each, frames) for name, each in streets.items()]
    write_dataset_report(out, frames, sheets, roads, progress)
    write_formats(out, frames, recipe.formats, progress)
    write_file_list(out, known or {})
    return frames


def _missing(out: Path, recipe: DatasetRecipe, block: Block) -> Block:
    """The frames of a block of which an image of a camera or a scan of a lidar is missing.

    All of them where a table of their folder is missing, so that it is made again.
    """
    folder = _rig_folder(out, recipe, block.take)
    whole = folder.has_tables()
    numbers = [n for n in block.numbers if not whole or not folder.has(n)]
    return Block(block.take, tuple(numbers))


def _rig_folder(out: Path, recipe: DatasetRecipe, take: Take) -> RigFolder:
    """The folder of a take's frames."""
    rig = read_rig(take.rig)
    models = rig_models(rig, take.rig, recipe.outputs)
    return RigFolder(out / take.folder, rig, recipe.outputs, models, recipe.lidar)


def _town_folder(out: Path, town: Town) -> Path:
    return out / "towns" / town.name


def _build_town(out: Path, town: Town, recipe: DatasetRecipe, cluster: Cluster) -> Sequence[Issue]:
    """Builds a town; unchanged chunks are kept.

    Times are left out of its tables, so that two runs write the same bytes.
    """
    folder = _town_folder(out, town)
    options = BuildOptions(
        town.road,
        town.country,
        town.area,
        out=folder,
        seed=town.seed,
        actors=recipe.actors,
        workers=cluster.workers,
        executor=cluster.name,
        address=cluster.address,
    )
    with locked(out / "towns", wait=True):  # shards may share the folder
        result = build(options)
        manifest = replace(result.manifest, seconds={})
        write_manifest(manifest, folder)
        words = read_profile(town.country, town.area).description
        report = folder / REPORT_FILE
        write_report(
            report, manifest, result.counts, result.issues, DRAWING_FILE, environment=words
        )
        moving = _add_traffic(folder, town, recipe)
    return [*result.issues, *moving]


def _add_traffic(folder: Path, town: Town, recipe: DatasetRecipe) -> tuple[Issue, ...]:
    """Puts moving actors onto a town, unless it has them from an earlier run of the recipe."""
    wanted = recipe.traffic
    if wanted is None or (folder / SUBLAYER).is_file():
        return ()
    options = SumoOptions(wanted.seconds, wanted.vehicles, wanted.pedestrians, town.seed)
    return add_traffic(folder, lambda: simulated(folder, town.road, options), town.seed).issues


def _draw(
    out: Path,
    recipe: DatasetRecipe,
    blocks: Sequence[Block],
    executor: Executor,
    progress: Progress,
) -> _Drawn:
    """Draws frames in this process or in several."""
    parts = [part for each in blocks for part in _parts(each, executor.slots)]
    work = [_Job(recipe, out.absolute(), part) for part in parts]
    total = sum(len(job.block.numbers) for job in work)
    drawn = _Drawn()

    def add(result: _Drawn) -> None:
        nonlocal drawn
        drawn += result
        progress("draw frames", drawn.asked, total)

    progress("draw frames", 0, max(total, 1))
    if work and not executor.is_alone(len(work)):
        executor.run(Tasks(_draw_job, work, _nothing, (), on_gpu=True), add)
        return drawn
    for job in work:
        cameras = len(read_rig(job.block.take.rig).camera)
        add(_draw_job(job, _frame_steps(progress, drawn.asked, total, cameras)))
    return drawn


def _frame_steps(progress: Progress, before: int, total: int, cameras: int) -> Progress:
    """Progress of a block, whose parts are frames of single cameras."""

    def told(step: str, done: int, _parts: int) -> None:
        if step == "draw frames":
            progress(step, before + done // cameras, total)

    return told


def _nothing() -> None:
    """Starts a process, which needs no shared data."""


def _parts(block: Block, slots: int) -> Iterator[Block]:
    """A block in parts for the processes."""
    count = len(block.numbers)
    size = min(-(-count // slots), _MOST)
    for first in range(0, count, size):
        yield Block(block.take, block.numbers[first : first + size])


def _draw_job(job: _Job, progress: Progress = lambda *_: None) -> _Drawn:
    """Draws the frames of a block that are missing."""
    recipe, take, numbers = job.recipe, job.block.take, job.block.numbers
    folder = _rig_folder(job.folder, recipe, take)
    missing = sum(not folder.has(number) for number in numbers)
    result = render_frames(
        _town_folder(job.folder, take.town) / STAGE_FILE,
        job.folder / take.folder,
        take.frames,
        rig=take.rig,
        seed=take.seed,
        trajectory=Trajectory(recipe.trajectory, recipe.spacing),
        light=LightChoice(take.weather, seed=take.seed, season=recipe.season),
        response=recipe.response,
        outputs=recipe.outputs,
        lidar=recipe.lidar,
        reach=recipe.range,
        numbers=numbers,
        progress=progress,
    )
    made = len(numbers) if result.removed else missing
    return _Drawn(len(numbers), made, result.removed, result.issues, (f"{take.folder}/",))


def _rows(out: Path, take: Take, streets: dict[str, Streets]) -> Iterator[IndexedFrame]:
    """The frames of a take, camera by camera, for the index."""
    rig = read_rig(take.rig)
    town, roads = take.town, streets[content_stem(take.town.road)]
    for camera in rig.camera:
        folder = take.folder if rig.is_single else f"{take.folder}/{camera.name}"
        for row in read_table(out / folder / "cameras.json")["frames"][: take.frames]:
            lane = row.get("lane", "")
            x, y, z, _ = (round(axis[3], 2) for axis in row["camera_to_world"])
            yield IndexedFrame(
                split=roads.split_of(lane),
                folder=folder,
                frame=row["frame"],
                road=content_stem(town.road),
                street=roads.of_lane(lane),
                country=town.country,
                area=town.area,
                seed=town.seed,
                weather=row.get("weather", ""),
                rig=Path(take.rig).stem,
                camera=camera.name,
                place=(x, y, z),
            )


def _map_of(name: str, streets: Streets, frames: Sequence[IndexedFrame]) -> RoadMap:
    seen = [each for each in frames if each.road == name]
    return RoadMap(
        name,
        streets.lines,
        np.array([each.place[:2] for each in seen]).reshape(-1, 2),
        tuple(each.split for each in seen),
    )
