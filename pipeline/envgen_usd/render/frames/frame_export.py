"""Camera images and label images of a composed stage: the steps in order."""

from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, refuse_issues
from envgen_usd.folder_lock import locked
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_response import CAMERA, RESPONSES
from envgen_usd.render.cameras.sensor_rig import DEFAULT_RIG, MountedCamera, read_rig
from envgen_usd.render.frames.film import ENGINES, MITSUBA, OPENGL, Film
from envgen_usd.render.frames.frame_folder import (
    DEFAULT_OUTPUTS,
    OUTPUTS,
    SUFFIXES,
    FrameFolder,
    camera_mark,
    fingerprint,
)
from envgen_usd.render.frames.frame_light import (
    FrameLight,
    LightChoice,
    chosen_season,
    lamp_issues,
    latitude_of,
)
from envgen_usd.render.frames.label_images import LabelImages, LabelPainter
from envgen_usd.render.frames.object_boxes import ObjectBox, ObjectBoxes
from envgen_usd.render.frames.optical_flow import optical_flow
from envgen_usd.render.frames.rig_folder import RigFolder
from envgen_usd.render.frames.scan_export import (
    check_lidar_choice,
    lidar_shots,
    rig_models,
    scan_all,
    scan_counts,
    scan_issues,
)
from envgen_usd.render.frames.scan_folder import LidarChoice
from envgen_usd.render.lighting.headlamps import Headlamps, headlamps_at
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import Packed, pack
from envgen_usd.render.path_tracing.mitsuba_variants import mitsuba_name, open_mitsuba
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.stage.stage_reader import open_stage
from envgen_usd.render.stage.stage_scene import RANGE, StageScene
from envgen_usd.render.trajectories.nearest_lanes import nearest_lanes
from envgen_usd.render.trajectories.trajectory import (
    DEFAULT_FRAMES,
    SPREAD,
    Trajectory,
    given_places,
    trajectory_poses,
)

if TYPE_CHECKING:
    from envgen_usd.render.drawing.lens_drawing import MakeRenderer
    from envgen_usd.render.drawing.render_passes import Frame

Progress: TypeAlias = Callable[[str, int, int], None]

_WRITERS = 2
_WAITING = 6
"""Largest number of frames in the write queue; a larger value uses more memory."""


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
    scene = opened.scene
    progress("read stage", 1, 1)
    lead = sensors.camera[0] if poses is not None or way.given else sensors.reference
    eyes = sensors.eyes(lead)
    if poses is None:
        limit = frames if frames or way.ends(scene) else DEFAULT_FRAMES
        # Flow and motion lead to the frame after the last.
        more = limit + 1 if limit and ("flow" in outputs or lidar.motion) else limit
        longer = trajectory_poses(way, scene, lead, more, seed, eyes, opened.refused)
        places = replace(longer, poses=longer.poses[:limit])
    else:
        longer = places = given_places(opened.refused, poses, eyes)
    records = _records(lights, scene, places.poses)
    issues = [*scene.issues, *lights.issues, *places.issues, *lamp_issues(scene.lamps, records)]
    settings = {"response": response, "engine": engine, "seed": seed, "range": reach}
    settings |= {"light": lights.settings, "headlamps": sensors.headlamps}
    mark = fingerprint(opened.digests, scene, settings)
    folder = RigFolder(Path(out), sensors, outputs, models, lidar)
    asked = range(len(places.poses)) if numbers is None else sorted(numbers)
    drawn = len(places.poses)
    images = asked if set(outputs) & SUFFIXES.keys() else ()
    shots = [_shot(folder, camera, longer.poses, drawn, lead, images) for camera in sensors.camera]
    leads = sensors.camera_poses(sensors.camera[0], longer.poses, lead)
    scans = lidar_shots(sensors, models, folder.scans, leads, drawn, lidar, asked)
    issues += scan_issues(sensors, scene, scans, lidar)
    if strict:
        refuse_issues(issues)
    with locked(Path(out), wait=True):  # several processes may draw frames of a folder
        removed = folder.remove_others(mark)
        removed += sum(shot.open(folder, mark, records) for shot in shots)
        removed += sum(each.open(mark) for each in scans)
        folder.record(opened.stage)
    film = Film(lights, sensors.camera[0], response, seed, frozenset(outputs), engine)
    renderer = _draw_all(opened, reach, film, shots, progress)
    scan_all(opened, scans, seed, progress)
    result = _result(shots, removed, places.refused, renderer, issues)
    return replace(result, **scan_counts(scans))


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
    unknown = sorted(set(outputs) - set(OUTPUTS))
    if unknown or not outputs:
        known = ", ".join(OUTPUTS)
        raise EnvgenError(f"render: unknown outputs {', '.join(unknown)}; known: {known}")
    if engine == MITSUBA:
        open_mitsuba()


@dataclass(frozen=True)
class _Shot:
    """The frames of a camera of the rig."""

    camera: MountedCamera
    folder: FrameFolder
    poses: Sequence[Pose]
    lamps: FloatArray
    asked: Sequence[int]
    beyond: Pose | None

    def following(self, number: int) -> Pose | None:
        """Pose of the next frame of the drive; `None` at its end."""
        ahead = [*self.poses[number + 1 : number + 2], *filter(None, [self.beyond])]
        route = self.poses[number].route
        return ahead[0] if ahead and ahead[0].route == route else None

    def headlamps(self, number: int) -> Headlamps:
        """Headlamps of the vehicle in a frame."""
        from_camera = np.linalg.inv(self.camera.vehicle_from_camera)
        return headlamps_at(self.lamps, self.poses[number].matrix @ from_camera)

    def open(self, rig: RigFolder, mark: str, records: Sequence[Mapping[str, object]]) -> int:
        """Opens the folder; returns the number of frames of another run that it removed."""
        return self.folder.open(
            camera_mark(mark, self.camera),
            rig.calibration(self.camera),
            self.poses,
            records,
        )

    @cached_property
    def missing(self) -> tuple[int, ...]:
        """Numbers of the frames that were not there before this run."""
        return tuple(n for n in self.asked if not self.folder.has(n))


def _shot(  # noqa: PLR0913, PLR0917 - what the frames of a camera follow from
    rig: RigFolder,
    camera: MountedCamera,
    poses: Sequence[Pose],
    drawn: int,
    lead: MountedCamera,
    asked: Sequence[int],
) -> _Shot:
    placed = rig.sensors.camera_poses(camera, poses, lead)
    lamps = np.array(rig.sensors.headlamps, np.float64).reshape(-1, 3)
    beyond = placed[drawn] if len(placed) > drawn else None
    return _Shot(camera, rig.frames_of(camera), placed[:drawn], lamps, asked, beyond)


def _result(
    shots: Sequence[_Shot], removed: int, refused: int, renderer: str, issues: Sequence[Issue]
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


def _draw_all(
    stage: StageScene, reach: float, film: Film, shots: Sequence[_Shot], progress: Progress
) -> str:
    """Draws the missing frames place by place; only what a place sees is in memory.

    A frame follows from its pose alone, so the order does not show. At each place one camera
    follows another; each needs its own memory. Returns the name of the renderer.
    """
    jobs = [(shot, number) for shot in shots for number in shot.missing]
    eyes = np.array([shot.poses[number].matrix[:3, 3] for shot, number in jobs]).reshape(-1, 3)
    done, renderer = 0, ""
    for cell in stage.places(eyes, reach):
        near = stage.near(eyes[cell], reach)
        packed = pack(near, reach)
        for shot in shots:
            numbers = sorted(jobs[job][1] for job in cell if jobs[job][0] is shot)
            if numbers:
                name = "" if len(shots) == 1 else shot.camera.name
                seen = replace(film, camera=shot.camera, sensor=name)
                told = partial(_told, progress, done, len(jobs))
                renderer = _draw(near, packed, seen, shot, numbers, told)
                done += len(numbers)
        del near, packed  # before the next place is packed
    return renderer


def _told(progress: Progress, before: int, total: int, done: int) -> None:
    progress("draw frames", before + done, total)


def _draw(  # noqa: PLR0913, PLR0917 - what frames follow from
    scene: Scene,
    packed: Packed,
    film: Film,
    shot: _Shot,
    numbers: Sequence[int],
    told: Callable[[int], None],
) -> str:
    """Draws frames of a camera; threads write the images meanwhile.

    Returns:
        Name of the renderer.
    """
    painter = LabelPainter(scene.scene_objects)
    waiting: deque[Future[None]] = deque()
    with open_context() as renderer, ThreadPoolExecutor(_WRITERS) as writers:
        from envgen_usd.render.drawing.lens_drawing import frame_drawing  # noqa: PLC0415 - binds the platform

        drawer = frame_drawing(scene, packed, shot.camera, _renderer(film))
        film = replace(film, inside=drawer.inside)
        maker = ObjectBoxes(scene, painter, shot.camera) if film.has_boxes else None
        for done, number in enumerate(numbers):
            told(done)
            light = film.lights.at(number) if film.has_colour else None
            frame = drawer.draw(
                shot.poses[number],
                light,
                colour=film.has_colour,
                normals=film.has_normals,
                headlamps=shot.headlamps(number),
            )
            images = painter.paint(frame.scene_objects)
            seen = partial(drawer.silhouettes, shot.poses[number])
            boxes = maker.boxes(shot.poses[number], images, seen) if maker else ()
            waiting.append(writers.submit(_write, shot, number, frame, images, boxes, film))
            # Written frames are asked at once, so that a full disk ends the run.
            while len(waiting) > _WAITING or (waiting and waiting[0].done()):
                waiting.popleft().result()
        for future in waiting:
            future.result()
        told(len(numbers))
    name = mitsuba_name() if film.is_traced else ""
    return ", ".join(filter(None, (renderer, name)))


def _renderer(film: Film) -> "MakeRenderer":
    """What draws pinhole pictures; a lens takes its own from them."""
    from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform
    from envgen_usd.render.path_tracing.path_tracer import TracedFrames  # noqa: PLC0415

    return TracedFrames if film.is_traced else FrameRenderer


def _write(  # noqa: PLR0913, PLR0917 - what the files of a frame follow from
    shot: _Shot,
    number: int,
    frame: "Frame",
    images: LabelImages,
    boxes: Sequence[ObjectBox],
    film: Film,
) -> None:
    """Writes the images of a frame."""
    rgb = film.picture(number, frame) if film.has_colour else None
    pose, following = shot.poses[number], shot.following(number)
    flow = optical_flow(shot.camera, frame.depth, pose, following) if film.has_flow else None
    shot.folder.write(number, rgb, frame.depth, frame.normals, images, flow, boxes)
