"""Camera images and label images of a composed stage: the steps in order."""

from collections import deque
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.camera_response import (
    CAMERA,
    IDEAL,
    RESPONSES,
    camera_picture,
    draw_settings,
    ideal_picture,
)
from envgen_usd.render.camera_rig import DEFAULT_RIG, Camera, read_rig
from envgen_usd.render.camera_route import Pose, around, drive
from envgen_usd.render.frame_folder import SUFFIXES, FrameFolder, fingerprint
from envgen_usd.render.frame_light import FrameLight, LightChoice
from envgen_usd.render.gl_context import open_context
from envgen_usd.render.label_images import LabelPainter
from envgen_usd.render.render_scene import Floats, Scene
from envgen_usd.render.scene_tiles import pack
from envgen_usd.render.spread_poses import spread
from envgen_usd.render.stage_reader import open_stage, read_scene
from envgen_usd.seeds import generator

if TYPE_CHECKING:
    from envgen_usd.render.render_passes import Frame

Progress: TypeAlias = Callable[[str, int, int], None]

SPREAD, DRIVE = "spread", "drive"
TRAJECTORIES = (SPREAD, DRIVE)
"""Names of the option ``--trajectory``."""
_WRITERS = 2
_WAITING = 6
"""Largest number of frames in the write queue; a larger value uses more memory."""


@dataclass(frozen=True)
class RenderResult:
    """Statistics of a render run.

    Attributes:
        rendered: Frames that this run rendered.
        kept: Frames of an earlier run.
        others: Further frames of this drive in the folder.
        removed: Removed frames of another stage, camera or drive.
        renderer: Name and version of the OpenGL implementation; empty if no frame was rendered.
        issues: Warnings about the stage.
    """

    rendered: int
    kept: int
    others: int
    removed: int
    renderer: str
    issues: tuple[Issue, ...]


def render_frames(  # noqa: PLR0913 - what the images follow from
    stage: Path | str,
    out: Path | str,
    frames: int = 20,
    *,
    rig: str = DEFAULT_RIG,
    spacing: float = 10.0,
    seed: int = 0,
    trajectory: str = SPREAD,
    light: LightChoice | None = None,
    response: str = CAMERA,
    outputs: Collection[str] = tuple(SUFFIXES),
    full_ids: bool = False,
    poses: Sequence[Pose] | None = None,
    progress: Progress = lambda _step, _done, _total: None,
) -> RenderResult:
    """Moves a camera along the lanes of a stage and writes camera and label images.

    The composed stage is the only input. Each image kind is a folder below `out` with a file for
    each frame: ``rgb`` (PNG), ``semantic`` (8-bit class ids), ``semantic_colour``, ``instance`` (16
    bits, id * 1000 + n), ``part`` (8-bit ids of parts, e.g. lane markings), ``depth`` (TIFF of
    32-bit floats) and ``objects`` (JSON, from instance values to prim paths). Depth is in metres
    along the optical axis, 0 in the sky. ``cameras.json`` holds the poses, and ``labels.json``
    names the ids. Existing frames of the same stage are kept.

    Args:
        stage: USD file.
        out: Output folder, created if missing.
        frames: Number of frames.
        rig: Name of a shipped rig, or a TOML file.
        spacing: Distance between two frames of a drive, metres.
        seed: Random seed of the poses, the light and the camera.
        trajectory: ``spread`` (over all lanes) or ``drive`` (along routes).
        light: Weather, hour and date; `None` for the light of the stage.
        response: ``camera`` (exposure, lens, noise, tone curve) or ``ideal``.
        outputs: Kinds of images; other kinds are not computed.
        full_ids: Also write images with a separate id for every object of the stage.
        poses: Camera pose of each frame; replaces the drive along the lanes.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The stage cannot be opened or rendered, `out` cannot be written, or OpenGL is
            missing.
    """
    if frames < 1 or not 0 < spacing < np.inf:
        raise EnvgenError("render: frames must be at least 1, and their spacing above 0 m")
    if trajectory not in TRAJECTORIES or response not in RESPONSES:
        known = ", ".join((*TRAJECTORIES, *RESPONSES))
        raise EnvgenError(f"render: unknown trajectory or response; known: {known}")
    unknown = sorted(set(outputs) - SUFFIXES.keys())
    if unknown or not outputs:
        known = ", ".join(SUFFIXES)
        raise EnvgenError(f"render: unknown outputs {', '.join(unknown)}; known: {known}")
    camera = read_rig(rig)
    progress("read stage", 0, 1)
    opened = open_stage(Path(stage))
    choice = light or LightChoice(seed=seed)
    lights = FrameLight(choice, opened)
    scene = read_scene(opened)
    progress("read stage", 1, 1)
    if poses is None:
        rng = generator(seed, "render", trajectory)
        poses = route_poses(scene, camera, frames, spacing, rng, trajectory)
    folder = FrameFolder(Path(out), full_ids=full_ids, outputs=outputs)
    picture = {"light": lights.settings, "response": response, "seed": seed}
    mark = fingerprint(opened, scene, camera, picture)
    records = [lights.record(number) for number in range(len(poses))]
    removed = folder.open(mark, camera, poses, scene.scene_objects, records)
    missing = [number for number in range(len(poses)) if not folder.has(number)]
    issues = [*scene.issues, *lights.issues, *_drive_issues(scene, poses, spacing)]
    renderer = ""
    if missing:
        film = Film(lights, response, seed, frozenset(outputs))
        renderer, drawn_issues = _draw(scene, camera, film, poses, missing, folder, progress)
        issues += drawn_issues
    kept = len(poses) - len(missing)
    others = folder.count() - len(poses)
    return RenderResult(len(missing), kept, others, removed, renderer, tuple(issues))


@dataclass(frozen=True)
class Film:
    """Turns radiance into pictures."""

    lights: FrameLight
    response: str
    seed: int
    outputs: frozenset[str]

    @property
    def has_colour(self) -> bool:
        """True if the pictures themselves are an output."""
        return "rgb" in self.outputs

    @property
    def has_labels(self) -> bool:
        """True if any label image is an output."""
        return bool(self.outputs - {"rgb", "depth"})

    def picture(self, number: int, radiance: Floats) -> ByteArray:
        """Develops the radiance (H x W x 3) of a frame."""
        if self.response == IDEAL:
            return ideal_picture(radiance)
        rng = generator(self.seed, "render", "camera", number)
        return camera_picture(radiance, draw_settings(rng), rng)


def route_poses(  # noqa: PLR0913, PLR0917 - what poses follow from
    scene: Scene,
    camera: Camera,
    frames: int,
    spacing: float,
    rng: np.random.Generator,
    trajectory: str = DRIVE,
) -> tuple[Pose, ...]:
    """Poses along the lanes, or around a stage without lanes."""
    if not scene.lanes:
        return around(scene.bounds, camera, frames)
    if trajectory == SPREAD and (poses := spread(scene.lanes, camera, frames, rng)):
        return poses
    return drive(scene.lanes, camera, frames, spacing, rng)


def _drive_issues(scene: Scene, poses: Sequence[Pose], spacing: float) -> list[Issue]:
    issues = []
    if not scene.lanes:
        message = "no lane centre lines on the stage; the camera circles the stage"
        issues.append(Issue("render.lanes", Severity.WARNING, "/", message))
    drives = 1 + max(pose.turn for pose in poses)
    if drives > 1:
        message = f"{len(poses)} frames need {drives} passes over all lanes"
        action = f"the frames of a place lie about {spacing / drives:.2g} m apart"
        issues.append(Issue("render.frames", Severity.INFO, "/", message, action))
    return issues


def _draw(  # noqa: PLR0913, PLR0917 - the run's parts
    scene: Scene,
    camera: Camera,
    film: Film,
    poses: Sequence[Pose],
    missing: Sequence[int],
    folder: FrameFolder,
    progress: Progress,
) -> tuple[str, list[Issue]]:
    """Draws the missing frames; threads write the images meanwhile."""
    painter = LabelPainter(scene.scene_objects)
    waiting: deque[Future[int]] = deque()
    crowded = 0
    with open_context() as renderer, ThreadPoolExecutor(_WRITERS) as writers:
        from envgen_usd.render.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        drawer = FrameRenderer(scene, pack(scene), camera)
        for done, number in enumerate(missing):
            progress("draw frames", done, len(missing))
            light = film.lights.at(number) if film.has_colour else None
            frame = drawer.draw(poses[number], light, colour=film.has_colour)
            waiting.append(writers.submit(_write, folder, number, frame, painter, film))
            while len(waiting) > _WAITING:
                crowded += waiting.popleft().result() > 0
        crowded += sum(future.result() > 0 for future in waiting)
        progress("draw frames", len(missing), len(missing))
    return renderer, _crowd_issues(crowded)


def _write(
    folder: FrameFolder, number: int, frame: "Frame", painter: LabelPainter, film: Film
) -> int:
    """Writes the images of a frame; returns the number of objects without a number."""
    images = painter.paint(frame.scene_objects) if film.has_labels else None
    rgb = film.picture(number, frame.radiance) if film.has_colour else None
    folder.write(number, rgb, frame.depth, painter.object_ids(frame.scene_objects), images)
    return images.unnumbered if images else 0


def _crowd_issues(frames: int) -> list[Issue]:
    if not frames:
        return []
    message = f"{frames} frames show more than 999 objects of a class; the smallest have n = 0"
    return [
        Issue("render.crowded", Severity.INFO, "/", message, "use --full-ids to number all objects")
    ]
