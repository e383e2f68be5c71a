"""Draws towns from above for renders/gallery: all roads of a build in one picture.

    python tools/birds_eye.py town01=BUILD fabriksgatan=BUILD --out renders/gallery

Each picture is a JPEG file, `birds_eye_NAME.jpg`.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.frames.frame_light import LightChoice
from envgen_usd.render.stage.stage_scene import StageScene

WIDTH, HEIGHT, FOCAL = 1280, 800, 950.0
"""Size and focal length of the drawn picture, pixels."""
SIZE, QUALITY = (1024, 640), 80
"""Size and quality of the stored picture; larger ones take more bytes."""
PITCH = np.radians(48.0)
"""Angle of the view below the horizon; a larger one hides less behind houses."""
FILLED = 0.92
"""Largest share of the picture's width and height that the roads take."""
RIG = f"""
[camera]
width = {WIDTH}
height = {HEIGHT}
fx = {FOCAL}
fy = {FOCAL}
cx = {(WIDTH - 1) / 2}
cy = {(HEIGHT - 1) / 2}
mount = 1.35
"""
AIR = """
summary = "Sun through clear air."
share = 1.0
elevation = [45.0, 60.0]
turbidity = [2.5, 3.0]
cover = [0.0, 0.1]
depth = [0.1, 0.3]
overcast = [0.0, 0.0]
light = [1.0, 1.0]
direct = [1.0, 1.0]
visibility = [60000.0, 80000.0]
wetness = [0.0, 0.0]
rain = [0.0, 0.0]
glow = [0.0, 0.0]
"""
_GROWTH, _FARTHEST, _NEAREST, _STEPS = 1.05, 20000.0, 80.0, 30


def pose_above(points: FloatArray) -> Pose:
    """The nearest place south of points from which all are in the picture (x right, z ahead)."""
    ahead = np.array([0.0, np.cos(PITCH), -np.sin(PITCH)])
    right = np.array([1.0, 0.0, 0.0])
    turn = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    half = np.array([WIDTH, HEIGHT]) * FILLED / 2.0
    away = _NEAREST
    while away < _FARTHEST:
        middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
        for _ in range(_STEPS):
            eye = middle - away * ahead
            seen = (points - eye) @ turn
            if seen[:, 2].min() <= 0.0:
                break
            places = FOCAL * seen[:, :2] / seen[:, 2:]
            if np.all(np.abs(places) <= half):
                matrix = np.eye(4)
                matrix[:3, :3], matrix[:3, 3] = turn, eye
                return Pose(matrix)
            off = (places[:, 1].max() + places[:, 1].min()) / 2.0
            middle[1] -= 0.5 * off / FOCAL * away / np.sin(PITCH)
        away *= _GROWTH
    raise SystemExit("the roads are too far apart for one picture")


def draw(build: Path, target: Path) -> None:
    """Draws the town of a build."""
    scene = StageScene(build / "stage.usda")
    points = np.concatenate([lane.points for lane in scene.scene.lanes])
    reach = 3.0 * float(np.linalg.norm(np.ptp(points, axis=0)))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "above.toml").write_text(RIG, encoding="utf-8")
        (folder / "air.toml").write_text(AIR, encoding="utf-8")
        render_frames(
            scene,
            folder / "frames",
            1,
            rig=str(folder / "above.toml"),
            poses=[pose_above(points)],
            reach=reach,
            light=LightChoice(str(folder / "air.toml"), hour=11.0),
            outputs=("rgb",),
            response="ideal",
        )
        with Image.open(next((folder / "frames").rglob("rgb/*.png"))) as image:
            image.convert("RGB").resize(SIZE, Image.Resampling.LANCZOS).save(
                target, "JPEG", quality=QUALITY, optimize=True
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("builds", nargs="+", help="NAME=FOLDER of a build")
    parser.add_argument("--out", type=Path, default=Path("renders/gallery"))
    options = parser.parse_args()
    for named in options.builds:
        title, folder_of_build = named.split("=", maxsplit=1)
        draw(Path(folder_of_build), options.out / f"birds_eye_{title}.jpg")
