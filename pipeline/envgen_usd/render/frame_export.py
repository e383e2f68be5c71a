"""Camera images and label images of a composed stage: the steps in order."""

from collections import deque
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from envgen_usd.errors import EnvgenError, Issue, Severity, refuse_issues
from envgen_usd.models.array_types import BoolArray, ByteArray
from envgen_usd.render.camera_response import (
    CAMERA,
    IDEAL,
    RESPONSES,
    camera_picture,
    draw_settings,
    ideal_picture,
)
from envgen_usd.render.camera_rig import DEFAULT_RIG, Camera, read_rig
from envgen_usd.render.camera_route import Pose
from envgen_usd.render.frame_folder import SUFFIXES, FrameFolder, fingerprint
from envgen_usd.render.frame_light import FrameLight, LightChoice
from envgen_usd.render.gl_context import open_context
from envgen_usd.render.label_images import LabelPainter
from envgen_usd.render.rain_streaks import add_rain
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.scene_tiles import pack
from envgen_usd.render.stage_reader import open_stage, read_scene
from envgen_usd.render.trajectory import SPREAD, Trajectory, given_places, trajectory_poses
from envgen_usd.seeds import generator

if TYPE_CHECKING:
    from envgen_usd.render.render_passes import Frame

Progress: TypeAlias = Callable[[str, int, int], None]

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
        refused: Places that were left out, because they lie inside of or close to an object; of
            given poses, those that lie there.
        renderer: Name and version of the OpenGL implementation; empty if no frame was rendered.
        issues: Warnings about the stage.
    """

    rendered: int
    kept: int
    others: int
    removed: int
    refused: int
    renderer: str
    issues: tuple[Issue, ...]


def render_frames(  # noqa: PLR0913 - what the images follow from
    stage: Path | str,
    out: Path | str,
    frames: int | None = None,
    *,
    rig: str = DEFAULT_RIG,
    seed: int = 0,
    trajectory: Trajectory | str = SPREAD,
    light: LightChoice | None = None,
    response: str = CAMERA,
    outputs: Collection[str] = tuple(SUFFIXES),
    full_ids: bool = False,
    poses: Sequence[Pose] | None = None,
    strict: bool = False,
    progress: Progress = lambda _step, _done, _total: None,
) -> RenderResult:
    """Moves a camera along the lanes of a stage and writes camera and label images.

    The composed stage is the only input. Each image kind is a folder below `out` with a file for
    each frame: ``rgb`` (PNG), ``semantic`` (8-bit class ids), ``semantic_colour``, ``instance`` (16
    bits, id * 1000 + n), ``part`` (8-bit ids of parts, e.g. lane markings), ``depth`` (TIFF of
    32-bit floats) and ``objects`` (JSON, from instance values to prim paths). Depth is in metres
    along the optical axis, or from the camera with a fisheye lens; 0 in the sky. ``cameras.json``
    holds the poses, and ``labels.json`` names the ids. Existing frames of the same stage are kept.

    Args:
        stage: USD file.
        out: Output folder, created if missing.
        frames: Largest number of frames; `None` for 20, or for all poses of a trajectory that
            ends.
        rig: Name of a shipped rig, or a TOML file.
        seed: Random seed of the poses, the light and the camera.
        trajectory: Where frames are; a name stands for its usual values.
        light: Weather, hour and date; `None` for the light of the stage.
        response: ``camera`` (exposure, lens, noise, tone curve) or ``ideal``.
        outputs: Kinds of images; other kinds are not computed.
        full_ids: Also write images with a separate id for every object of the stage.
        poses: Camera pose of each frame; replaces the trajectory.
        strict: Issues are errors; those of the stage end the run before the first frame.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The stage cannot be opened or rendered, `out` cannot be written, or OpenGL is
            missing.
    """
    if frames is not None and frames < 1:
        raise EnvgenError("render: frames must be at least 1")
    way = Trajectory(trajectory) if isinstance(trajectory, str) else trajectory
    way.check()
    if response not in RESPONSES:
        raise EnvgenError(f"render: unknown response {response}; known: {', '.join(RESPONSES)}")
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
        places = trajectory_poses(way, scene, camera, frames, seed)
    else:
        places = given_places(scene, poses)
    poses = places.poses
    issues = [*scene.issues, *lights.issues, *places.issues]
    if strict:
        refuse_issues(issues)
    folder = FrameFolder(Path(out), full_ids=full_ids, outputs=outputs)
    picture = {"light": lights.settings, "response": response, "seed": seed}
    mark = fingerprint(opened, scene, camera, picture)
    records = [lights.record(number) for number in range(len(poses))]
    removed = folder.open(mark, camera, poses, scene.scene_objects, records)
    missing = [number for number in range(len(poses)) if not folder.has(number)]
    renderer = ""
    if missing:
        film = Film(lights, camera, response, seed, frozenset(outputs))
        renderer, drawn_issues = _draw(scene, camera, film, poses, missing, folder, progress)
        issues += drawn_issues
        if strict:
            refuse_issues(issues)
    kept = len(poses) - len(missing)
    others = folder.count() - len(poses)
    return RenderResult(
        len(missing), kept, others, removed, places.refused, renderer, tuple(issues)
    )


@dataclass(frozen=True)
class Film:
    """Turns radiance into pictures.

    Attributes:
        lights: Light of the frames.
        camera: The camera.
        response: ``camera`` or ``ideal``.
        seed: Seed of the camera's settings and noise.
        outputs: Kinds of images.
        inside: H x W, True within the image circle of the lens; `None` for the whole image.
    """

    lights: FrameLight
    camera: Camera
    response: str
    seed: int
    outputs: frozenset[str]
    inside: BoolArray | None = None

    @property
    def has_colour(self) -> bool:
        """True if the pictures themselves are an output."""
        return "rgb" in self.outputs

    @property
    def has_instances(self) -> bool:
        """True if the numbers of objects are an output."""
        return bool(self.outputs & {"instance", "objects"})

    def picture(self, number: int, frame: "Frame") -> ByteArray:
        """Develops the radiance of a frame."""
        if self.response == IDEAL:
            return ideal_picture(frame.radiance)
        rng = generator(self.seed, "render", "camera", number)
        rain = generator(self.seed, "render", "rain", number)
        radiance = add_rain(frame.radiance, frame.depth, self.camera, frame.rain, rain)
        settings = draw_settings(rng)
        return camera_picture(radiance, settings, rng, self.inside, frame.white)


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
        from envgen_usd.render.lens_drawing import frame_drawing  # noqa: PLC0415 - binds the platform

        drawer = frame_drawing(scene, pack(scene), camera)
        film = replace(film, inside=drawer.inside)
        for done, number in enumerate(missing):
            progress("draw frames", done, len(missing))
            light = film.lights.at(number) if film.has_colour else None
            frame = drawer.draw(poses[number], light, colour=film.has_colour)
            waiting.append(writers.submit(_write, folder, number, frame, painter, film))
            # Written frames are asked at once, so that a full disk ends the run.
            while len(waiting) > _WAITING or (waiting and waiting[0].done()):
                crowded += waiting.popleft().result() > 0
        crowded += sum(future.result() > 0 for future in waiting)
        progress("draw frames", len(missing), len(missing))
    return renderer, _crowd_issues(crowded)


def _write(
    folder: FrameFolder, number: int, frame: "Frame", painter: LabelPainter, film: Film
) -> int:
    """Writes the images of a frame; returns the number of objects without a number."""
    images = painter.paint(frame.scene_objects)
    rgb = film.picture(number, frame) if film.has_colour else None
    folder.write(number, rgb, frame.depth, images)
    return images.unnumbered if film.has_instances else 0


def _crowd_issues(frames: int) -> list[Issue]:
    if not frames:
        return []
    message = f"{frames} frames show more than 999 objects of a class; the smallest have n = 0"
    return [
        Issue("render.crowded", Severity.INFO, "/", message, "use --full-ids to number all objects")
    ]
