"""Pictures of the town for the report of a build, made by the renderer."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from PIL import Image

from envgen_usd.build_report import Picture, show_pictures
from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_light import LightChoice
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.step_clock import Progress
from envgen_usd.whole_files import make_folder, part_folder, whole_file

FOLDER = "report"
"""Folder of the pictures beside the report."""
_KINDS = {"rgb": "", "semantic_colour": "labels"}
_STREETS = 2
ABOVE = LightChoice(str(resources.files("envgen_usd.renders") / "report_light.toml"))
"""Light from above, as shadows of the sun are made for cameras on the street, in air so clear that
haze hides nothing of a large town."""
_NEAREST = 120.0
"""Least width of the bird's-eye view, metres."""
_QUALITY = 85


@dataclass(frozen=True)
class _View:
    """Frames from given or found places.

    Attributes:
        title: What they show.
        poses: Poses of the camera; `None` for places along the lanes.
        count: Number of frames.
        reach: Range of what is drawn, metres.
        light: Light of the frames; `None` for that of the stage.
    """

    title: str
    poses: Sequence[Pose] | None
    count: int
    reach: float
    light: LightChoice | None = None


def add_pictures(
    stage: Path, report: Path, progress: Progress = lambda _step, _done, _total: None
) -> str:
    """Draws a bird's-eye view and two street views with their labels, and shows them in the report.

    Returns:
        Why there are no pictures, e.g. without OpenGL; empty where there are.

    Raises:
        EnvgenError: A file cannot be written.
    """
    progress("pictures", 0, 1)
    try:
        scene = StageScene(stage)
        bounds = scene.scene.bounds
        far = float(np.linalg.norm(bounds[1] - bounds[0]))
        views = [_View("Bird's-eye view", [_bird(scene.scene)], 1, 2.0 * far, ABOVE)]
        if scene.scene.lanes:
            views.append(_View("Street", None, _STREETS, 1000.0))
        with part_folder(report.parent) as folder:
            pictures = [
                picture
                for number, view in enumerate(views)
                for picture in _drawn(scene, view, folder / str(number), report)
            ]
    except EnvgenError as error:
        show_pictures(report, (), f"No pictures of the town: {error}")
        return str(error)
    show_pictures(report, pictures)
    progress("pictures", 1, 1)
    return ""


def _drawn(scene: StageScene, view: _View, folder: Path, report: Path) -> list[Picture]:
    """Draws the frames of a view, and stores them as JPEG files beside the report."""
    render_frames(
        scene,
        folder,
        view.count,
        poses=view.poses,
        reach=view.reach,
        light=view.light,
        outputs=tuple(_KINDS),
    )
    pictures = []
    make_folder(report.parent / FOLDER)
    for kind, note in _KINDS.items():
        for number, source in enumerate(sorted((folder / kind).glob("*.png"))):
            stem = "_".join([view.title.split()[0].lower().replace("'", ""), kind, str(number)])
            target = report.parent / FOLDER / f"{stem}.jpg"
            with whole_file(target) as part, Image.open(source) as image:
                image.convert("RGB").save(part, "JPEG", quality=_QUALITY)
            title = f"{view.title}, {note}" if note else view.title
            pictures.append(Picture(f"{FOLDER}/{target.name}", title))
    return pictures


def _bird(scene: Scene) -> Pose:
    """Above the south of the roads, looking at their middle (camera: x right, y down, z ahead)."""
    corners = np.concatenate([lane.points for lane in scene.lanes] or [scene.bounds])
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = (low + high) / 2.0
    size = max(float(high[0] - low[0]), 1.3 * float(high[1] - low[1]), _NEAREST)
    eye = middle + size * np.array((0.0, -0.45, 0.35))
    ahead = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.array((1.0, 0.0, 0.0))
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    matrix[:3, 3] = eye
    return Pose(matrix)
