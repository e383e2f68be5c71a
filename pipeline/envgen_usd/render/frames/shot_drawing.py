"""Draws the missing frames of all cameras and writes them."""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from envgen_usd.render.drawing.drawn_frame import Frame, FrameRequest
from envgen_usd.render.frames.film import Film
from envgen_usd.render.frames.frame_moments import frame_moments
from envgen_usd.render.frames.label_images import LabelImages, LabelPainter
from envgen_usd.render.frames.object_boxes import ObjectBox, ObjectBoxes
from envgen_usd.render.frames.optical_flow import BodyMotion, optical_flow
from envgen_usd.render.frames.shots import Shot
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import Packed, pack
from envgen_usd.render.path_tracing.mitsuba_variants import mitsuba_name
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.stage.moving_objects import MovingObjects
from envgen_usd.render.stage.stage_scene import StageScene

if TYPE_CHECKING:
    from envgen_usd.render.drawing.lens_drawing import MakeRenderer

Progress: TypeAlias = Callable[[str, int, int], None]

_WRITERS = 2
_WAITING = 6
"""Largest number of frames in the write queue; a larger value uses more memory."""


def draw_shots(
    stage: StageScene, reach: float, film: Film, shots: Sequence[Shot], progress: Progress
) -> str:
    """Draws the missing frames place by place; only what a place sees is in memory.

    A frame follows from its pose alone, so the order does not show. At each place one camera
    follows another; each needs its own memory. Returns the name of the renderer.
    """
    jobs = [(shot, number) for shot in shots for number in shot.missing]
    eyes = np.array([shot.poses[number].matrix[:3, 3] for shot, number in jobs]).reshape(-1, 3)
    done, renderer = 0, ""
    for cell in stage.places(eyes, reach):
        near, packed = stage.prepared(eyes[cell], reach, pack)
        for shot in shots:
            numbers = sorted(jobs[job][1] for job in cell if jobs[job][0] is shot)
            if numbers:
                name = "" if len(shots) == 1 else shot.camera.name
                seen = replace(film, camera=shot.camera, sensor=name)
                told = partial(_told, progress, done, len(jobs))
                renderer = _draw(near, packed, seen, shot, numbers, told, stage.moving)
                done += len(numbers)
        del near, packed  # before the next place is packed
    return renderer


def _told(progress: Progress, before: int, total: int, done: int) -> None:
    progress("draw frames", before + done, total)


def _draw(  # noqa: PLR0913, PLR0917 - what frames follow from
    scene: Scene,
    packed: Packed,
    film: Film,
    shot: Shot,
    numbers: Sequence[int],
    told: Callable[[int], None],
    moving: MovingObjects | None = None,
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
            moments = frame_moments(shot, number, moving)
            request = FrameRequest(
                shot.poses[number],
                film.lights.at(number) if film.has_colour else None,
                film.has_colour,
                film.has_normals,
                shot.headlamps(number),
                moments.now,
            )
            frame = drawer.draw(request)
            images = painter.paint(frame.scene_objects)
            seen = partial(drawer.silhouettes, shot.poses[number])
            pose = shot.poses[number]
            boxes = maker.boxes(pose, images, seen, moments.beside(pose)) if maker else ()
            motion = moments.motion(frame) if film.has_flow else None
            content = frame, images, boxes, motion
            waiting.append(writers.submit(_write, shot, number, film, *content))
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
    shot: Shot,
    number: int,
    film: Film,
    frame: Frame,
    images: LabelImages,
    boxes: Sequence[ObjectBox],
    motion: BodyMotion | None,
) -> None:
    """Writes the images of a frame."""
    rgb = film.picture(number, frame) if film.has_colour else None
    pose, following = shot.poses[number], shot.following(number)
    flow = None
    if film.has_flow:
        flow = optical_flow(shot.camera, frame.depth, pose, following, motion)
    shot.folder.write(number, rgb, frame.depth, frame.normals, images, flow, boxes)
