"""Camera images and label images of a composed stage: the steps in order."""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.render.context import open_context
from envgen_usd.render.frames import FrameFolder, fingerprint
from envgen_usd.render.labels import LabelImages, LabelPainter
from envgen_usd.render.rig import DEFAULT_RIG, Camera, Pose, around, drive, read_rig
from envgen_usd.render.scene import Scene
from envgen_usd.render.stage import open_stage, read_scene
from envgen_usd.render.tiles import pack
from envgen_usd.seeds import generator

if TYPE_CHECKING:
    from envgen_usd.render.passes import Frame

Progress: TypeAlias = Callable[[str, int, int], None]

_WRITERS = 2
_WAITING = 6
"""Frames that may wait to be written, so that memory stays bounded."""


@dataclass(frozen=True)
class RenderResult:
    """What a run did.

    Attributes:
        rendered: Frames that this run drew.
        kept: Frames that were there already.
        others: Further frames of this drive that are in the folder.
        removed: Frames of another stage, camera or drive that were in the folder and are gone.
        renderer: Name and version of the OpenGL implementation, empty if nothing was drawn.
        issues: What was odd on the stage.
    """

    rendered: int
    kept: int
    others: int
    removed: int
    renderer: str
    issues: tuple[Issue, ...]


def render_frames(  # noqa: PLR0913 - what the images follow from
    stage: Path,
    out: Path,
    frames: int = 20,
    *,
    rig: str = DEFAULT_RIG,
    spacing: float = 10.0,
    seed: int = 0,
    full_ids: bool = False,
    poses: Sequence[Pose] | None = None,
    progress: Progress = lambda _step, _done, _total: None,
) -> RenderResult:
    """Drives a camera along the lanes of a stage and writes what it sees.

    Reads nothing but the composed stage. Writes ``rgb`` (PNG), ``semantic`` (8-bit class ids),
    ``semantic_colour``, ``instance`` (16 bits, id * 1000 + n), ``part`` (8-bit ids of parts, e.g.
    lane markings, window panes), ``depth`` (TIFF of 32-bit floats, metres along the optical axis,
    0 in the sky) and ``objects`` (JSON, from instance values to prim paths) below `out`, each with
    one file a frame, and ``cameras.json`` and ``labels.json``, what the ids mean. Frames that are
    there already and show this very stage are kept.

    Args:
        stage: USD file.
        out: Folder for the images, made if need be.
        frames: Number of frames.
        rig: A rig of the package, by name, or a TOML file.
        spacing: Metres that the car drives between two frames.
        seed: Draws where the car starts and which way it turns.
        full_ids: Also write an image with a number of its own for every object of the stage.
        poses: Where the camera is in each frame, in place of a drive along the lanes.
        progress: Called with a step's name, how much of it is done, and of how much.

    Raises:
        EnvgenError: If the stage cannot be opened or drawn, if `out` cannot be written, or if
            there is no OpenGL.
    """
    if frames < 1 or not 0 < spacing < np.inf:
        raise EnvgenError("render: frames must be at least 1, and their spacing above 0 m")
    camera = read_rig(rig)
    progress("read stage", 0, 1)
    opened = open_stage(stage)
    scene = read_scene(opened)
    progress("read stage", 1, 1)
    if poses is None:
        rng = generator(seed, "render", "drive")
        poses = route_poses(scene, camera, frames, spacing, rng)
    folder = FrameFolder(out, full_ids=full_ids)
    removed = folder.open(fingerprint(opened, scene, camera), camera, poses, scene.things)
    missing = [number for number in range(len(poses)) if not folder.has(number)]
    issues = [*scene.issues, *_drive_issues(scene, poses, spacing)]
    renderer = ""
    if missing:
        renderer, found = _draw(scene, camera, poses, missing, folder, progress)
        issues += found
    kept = len(poses) - len(missing)
    others = folder.count() - len(poses)
    return RenderResult(len(missing), kept, others, removed, renderer, tuple(issues))


def route_poses(
    scene: Scene, camera: Camera, frames: int, spacing: float, rng: np.random.Generator
) -> tuple[Pose, ...]:
    """Poses of a drive along the lanes, or around a stage that has none."""
    if not scene.lanes:
        return around(scene.bounds, camera, frames)
    return drive(scene.lanes, camera, frames, spacing, rng)


def _drive_issues(scene: Scene, poses: Sequence[Pose], spacing: float) -> list[Issue]:
    found = []
    if not scene.lanes:
        message = "no lane centre lines on the stage; the camera goes round it"
        found.append(Issue("render.lanes", Severity.WARNING, "/", message))
    drives = 1 + max(pose.turn for pose in poses)
    if drives > 1:
        message = f"all lanes are driven {drives} times to make {len(poses)} frames"
        action = f"frames that show one place lie about {spacing / drives:.2g} m apart"
        found.append(Issue("render.frames", Severity.INFO, "/", message, action))
    return found


def _draw(  # noqa: PLR0913, PLR0917 - the run's parts
    scene: Scene,
    camera: Camera,
    poses: Sequence[Pose],
    missing: Sequence[int],
    folder: FrameFolder,
    progress: Progress,
) -> tuple[str, list[Issue]]:
    """Draws the missing frames; images are written by other threads meanwhile."""
    painter = LabelPainter(scene.things)
    waiting: deque[Future[LabelImages]] = deque()
    crowded = 0
    with open_context() as renderer, ThreadPoolExecutor(_WRITERS) as writers:
        from envgen_usd.render.passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        drawer = FrameRenderer(scene, pack(scene), camera)
        for done, number in enumerate(missing):
            progress("draw frames", done, len(missing))
            frame = drawer.draw(poses[number])
            waiting.append(writers.submit(_write, folder, number, frame, painter))
            while len(waiting) > _WAITING:
                crowded += waiting.popleft().result().unnumbered > 0
        crowded += sum(future.result().unnumbered > 0 for future in waiting)
        progress("draw frames", len(missing), len(missing))
    return renderer, _crowd_issues(crowded)


def _write(folder: FrameFolder, number: int, frame: "Frame", painter: LabelPainter) -> LabelImages:
    images = painter.paint(frame.things)
    folder.write(number, frame.rgb, frame.depth, painter.object_ids(frame.things), images)
    return images


def _crowd_issues(frames: int) -> list[Issue]:
    if not frames:
        return []
    message = f"{frames} frames show more than 999 objects of a class; the smallest have n = 0"
    return [Issue("render.crowded", Severity.INFO, "/", message, "use --full-ids for all")]
