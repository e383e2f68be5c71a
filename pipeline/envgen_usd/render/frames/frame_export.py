"""Camera images and label images of a composed stage: the steps in order."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from envgen_usd.errors import EnvgenError, Issue, Severity, refuse_issues
from envgen_usd.executors.executor import ALONE, Executor
from envgen_usd.folder_lock import locked
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_response import CAMERA, RESPONSES
from envgen_usd.render.cameras.sensor_rig import DEFAULT_RIG, read_rig
from envgen_usd.render.frames.film import ENGINES, MITSUBA, OPENGL
from envgen_usd.render.frames.frame_batches import BatchResult, draw_in_batches
from envgen_usd.render.frames.frame_folder import (
    DEFAULT_OUTPUTS,
    OUTPUTS,
    fingerprint,
)
from envgen_usd.render.frames.frame_light import (
    FrameLight,
    LightChoice,
    chosen_season,
    lamp_issues,
    latitude_of,
)
from envgen_usd.render.frames.frame_run import Drawing, Drive, FrameRun
from envgen_usd.render.frames.scan_export import (
    check_lidar_choice,
    rig_models,
    scan_counts,
    scan_issues,
)
from envgen_usd.render.frames.scan_folder import LidarChoice
from envgen_usd.render.frames.shot_drawing import Progress
from envgen_usd.render.frames.shots import Shot
from envgen_usd.render.path_tracing.mitsuba_variants import open_mitsuba
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.stage.moving_objects import MovingObjects
from envgen_usd.render.stage.stage_reader import open_stage
from envgen_usd.render.stage.stage_scene import RANGE, StageScene
from envgen_usd.render.stage.usd_errors import usd_errors_named
from envgen_usd.render.trajectories.frame_times import drawn_times, late_issues
from envgen_usd.render.trajectories.nearest_lanes import nearest_lanes
from envgen_usd.render.trajectories.trajectory import (
    DEFAULT_FRAMES,
    SPREAD,
    TRAFFIC,
    Places,
    Trajectory,
    given_places,
    trajectory_poses,
)


@dataclass(frozen=True)
class RenderResult:
    """Statistics of a render run.

    Attributes:
        cameras: Names of the cameras; several have a folder each.
        rendered: Frames that this run rendered, of all cameras.
        kept: Frames of an earlier run.
        others: Further frames of this drive in the folder.
        removed: Removed frames and scans of another stage, sensor or drive.
        refused: Places that were left out, because they lie inside of or close to an object; of
            given poses, those that lie there.
        renderer: Name and version of the OpenGL implementation; empty if no frame was rendered.
        issues: Warnings about the stage.
        lidars: Names of the lidars that were scanned; each has a folder.
        scanned: Scans of this run.
        scans_kept: Scans of an earlier run.
    """

    cameras: tuple[str, ...]
    rendered: int
    kept: int
    others: int
    removed: int
    refused: int
    renderer: str
    issues: tuple[Issue, ...]
    lidars: tuple[str, ...] = ()
    scanned: int = 0
    scans_kept: int = 0


@usd_errors_named()
def render_frames(  # noqa: PLR0913 - what the images follow from
    stage: Path | str | StageScene,
    out: Path | str,
    frames: int | None = None,
    *,
    rig: str = DEFAULT_RIG,
    seed: int = 0,
    trajectory: Trajectory | str = SPREAD,
    light: LightChoice | None = None,
    response: str = CAMERA,
    engine: str = OPENGL,
    outputs: Collection[str] = DEFAULT_OUTPUTS,
    lidar: LidarChoice = LidarChoice(),  # noqa: B008 - is frozen
    reach: float = RANGE,
    poses: Sequence[Pose] | None = None,
    numbers: Collection[int] | None = None,
    strict: bool = False,
    cache: bool = True,
    executor: Executor | None = None,
    progress: Progress = lambda _step, _done, _total: None,
) -> RenderResult:
    """Moves a camera along the lanes of a stage and writes camera and label images.

    The composed stage is the only input. Each image kind is a folder below `out` with a file for
    each frame: ``rgb`` (PNG), ``semantic`` (8-bit class ids), ``semantic_colour``, ``instance``
    (TIFF of 32 bits, id * 10,000,000 + n, the same for an object in all frames), ``part`` (8-bit
    ids of parts, e.g. lane markings), ``depth`` (TIFF of 32-bit floats), ``normals`` (16-bit PNG)
    and ``objects`` (JSON, from instance values to prim paths). On demand, ``boxes`` (JSON) and
    ``flow`` (.flo). Depth is in metres along the optical axis, or from the camera with a fisheye
    lens; 0 in the sky. Normals are along the camera's axes. ``lidar`` scans each lidar of the rig
    into a folder of its name.
    ``cameras.json`` holds the poses, and ``labels.json`` names the ids. Existing frames of the same
    stage are kept.

    A rig with several cameras has such a folder below `out` for each, by its name, and a common
    ``cameras.json``. ``cameras.usda`` is the rig over the stage, for other programs.

    Args:
        stage: USD file, or a stage that was opened for several calls.
        out: Output folder, created if missing.
        frames: Largest number of frames; `None` for 20, or for all poses of a trajectory that
            ends.
        rig: Name of a shipped rig, or a TOML file.
        seed: Random seed of the poses, the light and the camera.
        trajectory: Where frames are; a name stands for its usual values.
        light: Weather, hour, date and season; `None` for those of the stage. An opened stage keeps
            its season.
        response: ``camera`` (exposure, lens, noise, tone curve) or ``ideal``.
        engine: What makes the pictures: ``opengl`` draws, ``mitsuba`` traces paths. Labels and
            depth are drawn in both cases.
        outputs: Kinds of outputs; other kinds are not computed.
        lidar: How the output ``lidar`` scans and what it writes.
        reach: Range of what is drawn, metres; the memory for a map follows it.
        poses: Pose of the first camera in each frame; replaces the trajectory.
        numbers: Numbers of the frames to draw; `None` for all of the trajectory.
        strict: Issues are errors; those of the stage end the run before the first frame.
        cache: Take what an earlier run read of the same layers; else the stage is read anew.
        executor: Who draws, in batches; `None` for this process.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The stage cannot be opened or rendered, `out` cannot be written, or OpenGL or
            Mitsuba is missing.
    """
    if frames is not None and frames < 1:
        raise EnvgenError("render: frames must be at least 1")
    way = Trajectory(trajectory) if isinstance(trajectory, str) else trajectory
    way.check()
    _check_choices(response, engine, outputs)
    sensors = read_rig(rig)
    check_lidar_choice(lidar)
    models = rig_models(sensors, rig, outputs)
    progress("read stage", 0, 1)
    choice = light or LightChoice(seed=seed)
    opened = _opened(stage, choice, cache=cache)
    lights = FrameLight(choice, opened.stage)
    progress("read stage", 1, 1)
    wanted = frozenset(outputs)
    run = FrameRun(
        Path(out), sensors, models, lidar, choice, lights.weathers, response, engine,
        seed, wanted, reach,
    )  # fmt: skip
    drive, places = _drive(run, opened, way, frames, poses)
    asked = range(drive.drawn) if numbers is None else numbers
    drawing = Drawing.of(run, opened, lights, drive, asked)
    drawn = drive.poses[: drive.drawn]
    records = _records(lights, opened.scene, drawn)
    issues = [*opened.scene.issues, *lights.issues, *places.issues]
    issues += lamp_issues(opened.scene.lamps, records)
    issues += scan_issues(sensors, opened.scene, drawing.scans, lidar)
    if strict:
        refuse_issues(issues)
    removed = _open_folder(drawing, records)
    said = _drawn(drawing, drive, executor or ALONE, progress, cache=cache)
    issues += _hidden_issues(said.hidden, drawn)
    result = _result(drawing.shots, removed, places.refused, said.renderer, issues)
    return replace(result, **scan_counts(drawing.scans))


def _drive(
    run: FrameRun,
    opened: StageScene,
    way: Trajectory,
    frames: int | None,
    poses: Sequence[Pose] | None,
) -> tuple[Drive, Places]:
    """Where the frames are, and what was decided about it."""
    sensors, scene = run.sensors, opened.scene
    given = poses is not None or bool(way.given)
    lead = sensors.camera[0] if given else sensors.reference
    eyes = sensors.eyes(lead)
    if poses is None:
        limit = frames if frames or way.ends(scene) else DEFAULT_FRAMES
        # Flow and motion lead to the frame after the last.
        more = limit + 1 if limit and ("flow" in run.outputs or run.lidar.motion) else limit
        moving = opened.moving if way.name == TRAFFIC else None
        rides = moving.rides(scene.scene_objects) if moving else ()
        places = trajectory_poses(way, scene, lead, more, run.seed, eyes, opened.refused, rides)
    else:
        limit, places = None, given_places(opened.refused, poses, eyes)
    places = _timed(places, opened.moving, run.seed, given=given)
    return Drive(places.poses, len(places.poses[:limit]), lead), places


def _open_folder(drawing: Drawing, records: Sequence[Mapping[str, object]]) -> int:
    """Prepares the folders; returns the number of frames and scans of other runs that it removed.

    Args:
        drawing: All frames.
        records: What is recorded of each of them.
    """
    run, opened, lights = drawing.run, drawing.opened, drawing.lights
    settings = {"response": run.response, "engine": run.engine, "seed": run.seed}
    settings |= {"range": run.reach, "light": lights.settings, "headlamps": run.sensors.headlamps}
    mark = fingerprint(opened.digests, opened.scene, settings)
    with locked(run.out, wait=True):  # several processes may draw frames of a folder
        removed = run.folder.remove_others(mark) + sum(each.open(mark) for each in drawing.scans)
        removed += sum(shot.open(run.folder, mark, records) for shot in drawing.shots)
        run.folder.record(opened.stage, opened.moving.clock if opened.moving else None)
    return removed


def _drawn(
    drawing: Drawing, drive: Drive, executor: Executor, progress: Progress, *, cache: bool
) -> BatchResult:
    """Draws what is missing, in this process where one is enough."""
    if executor.is_alone(len(drawing.missing)) or not drawing.missing:
        renderer = drawing.draw(progress)
        moving = drawing.opened.moving
        return BatchResult(renderer, tuple(moving.hidden) if moving else ())
    return draw_in_batches(drawing, drive, executor, progress, cache=cache)


def _timed(places: Places, moving: MovingObjects | None, seed: int, *, given: bool) -> Places:
    """Frames of no drive have drawn times where something moves; given ones keep theirs."""
    if moving is None:
        return places
    duration = moving.clock.duration
    poses = places.poses if given else drawn_times(places.poses, duration, seed)
    return replace(places, poses=poses, issues=(*places.issues, *late_issues(poses, duration)))


def _hidden_issues(hidden: Sequence[str], poses: Sequence[Pose]) -> list[Issue]:
    """Names what drove into the vehicle of the sensors, besides those whose place it takes."""
    taken = {pose.vehicle for pose in poses}
    met = sorted(path for path in hidden if path not in taken)
    if not met:
        return []
    message = f"{len(met)} moving objects overlap the vehicle of the sensors in frames"
    return [Issue("render.own_vehicle", Severity.INFO, met[0], message, "they are hidden there")]


def _records(lights: FrameLight, scene: Scene, poses: Sequence[Pose]) -> list[dict[str, object]]:
    """What is recorded of each frame besides its pose: light, and lane if it is on one."""
    return [
        {**({"lane": name} if name else {}), **lights.record(number)}
        for number, name in enumerate(nearest_lanes(scene.lanes, poses))
    ]


def _opened(stage: Path | str | StageScene, choice: LightChoice, *, cache: bool) -> StageScene:
    """Opens a stage in the season of a run, unless it is open."""
    if isinstance(stage, StageScene):
        return stage
    latitude = latitude_of(open_stage(Path(stage), payloads=False))
    return StageScene(stage, chosen_season(choice, latitude), cache=cache)


def _check_choices(response: str, engine: str, outputs: Collection[str]) -> None:
    if response not in RESPONSES:
        raise EnvgenError(f"render: unknown response {response}; known: {', '.join(RESPONSES)}")
    if engine not in ENGINES:
        raise EnvgenError(f"render: unknown engine {engine}; known: {', '.join(ENGINES)}")
    unknown, known = sorted(set(outputs) - set(OUTPUTS)), ", ".join(OUTPUTS)
    if not outputs:
        raise EnvgenError(f"render: no outputs named; known: {known}")
    if unknown:
        raise EnvgenError(f"render: unknown outputs {', '.join(unknown)}; known: {known}")
    if engine == MITSUBA:
        open_mitsuba()


def _result(
    shots: Sequence[Shot], removed: int, refused: int, renderer: str, issues: Sequence[Issue]
) -> RenderResult:
    rendered = sum(len(shot.missing) for shot in shots)
    total = sum(len(shot.asked) for shot in shots)
    return RenderResult(
        cameras=tuple(shot.camera.name for shot in shots),
        rendered=rendered,
        kept=total - rendered,
        others=sum(shot.folder.count() for shot in shots) - total,
        removed=removed,
        refused=refused,
        renderer=renderer,
        issues=tuple(issues),
    )
