"""Compares the light of drawn images with that of path-traced ones.

    python benchmarks/light.py OUT_A/stage.usda OUT_B/stage.usda --views 5

Each view is drawn by the exporter and traced by Mitsuba 3 with the same scene, camera and light, in
three weathers of the stage, without haze and without water on the ground. The tables show for each
weather, over its views: mean luminance by class, the contrast between shadow and sun on the road,
that between sky and road, and the distance of the histograms. With `--keep`, traced images are read
again in later runs.
"""

import argparse
import hashlib
from collections import defaultdict
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from pxr import Usd
from scipy.ndimage import binary_erosion
from scipy.stats import wasserstein_distance

from envgen_usd.light.daylight import LUMINANCE
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_response import ideal_picture
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.frames.image_files import write_png
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.render_scene import Floats, Scene
from envgen_usd.render.stage.stage_reader import open_stage, read_scene
from envgen_usd.render.stage.sun_and_sky import read_light
from envgen_usd.render.trajectories.trajectory import SPREAD, Trajectory, trajectory_poses

WEATHERS = ("clear", "overcast", "low_sun")
CLASSES = ("road", "sidewalk", "building", "vegetation", "terrain", "sky")
NEAR = 120.0
"""Distance in metres up to which surfaces count; both engines hold them whole."""
DISC = 20.0
"""Luminance above which a pixel of the sky shows the sun's disc, which is drawn but not traced."""


@dataclass
class View:
    """What a view contributes: luminance of both engines, and which pixels are what."""

    drawn: np.ndarray
    traced: np.ndarray
    classes: dict[str, np.ndarray]
    shadow: np.ndarray
    sunlit: np.ndarray


def camera_of(width: int) -> Camera:
    """A camera with the field of view of KITTI-360's."""
    focal = 0.39 * width
    return Camera(width, round(width * 0.68), focal, focal, 0.48 * width, 0.34 * width)


def lights_of(stage: Usd.Stage) -> dict[str, Atmosphere]:
    """The light of each weather, without haze and water."""
    weathers = stage.GetPrimAtPath("/World/Environment").GetVariantSet("weather")
    lights = {}
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for name in WEATHERS:
            weathers.SetVariantSelection(name)
            light, _ = read_light(stage, Usd.TimeCode.EarliestTime())
            lights[name] = replace(light, visibility=1e9, wetness=0.0)
    return lights


def kept(folder: Path | None, name: str, pose: Pose, light: Atmosphere) -> Path | None:
    """File of a traced image; another pose or light is another file."""
    if folder is None:
        return None
    folder.mkdir(parents=True, exist_ok=True)
    digest = hashlib.sha256(pose.matrix.tobytes() + light.sky.tobytes() + light.sun.tobytes())
    return folder / f"{name}-{digest.hexdigest()[:12]}.npy"


def masks(scene: Scene, objects: np.ndarray, depth: Floats) -> dict[str, np.ndarray]:
    """Pixels of each class, without edges, where both engines might differ by half a pixel."""
    labels = np.array([thing.label for thing in scene.scene_objects])[objects]
    near = (depth < NEAR) | (labels == "sky")
    return {name: binary_erosion((labels == name) & near) for name in CLASSES}


def shares_of_sun(sun_only: Floats, road: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels of the road in the shadow and in the sun, from an image by the sun alone."""
    lit = sun_only @ LUMINANCE
    if not road.any() or lit[road].max() <= 0.0:
        return np.zeros_like(road), np.zeros_like(road)
    usual = float(np.quantile(lit[road], 0.9))
    dark = binary_erosion(road & (lit < 0.03 * usual), iterations=2)
    bright = binary_erosion(road & (lit > 0.5 * usual), iterations=2)
    return dark, bright


def draw_all(path: Path, options: argparse.Namespace) -> dict[str, list[View]]:
    stage = open_stage(path)
    scene, lights = read_scene(stage), lights_of(stage)
    camera = camera_of(options.width)
    places = trajectory_poses(Trajectory(SPREAD), scene, camera, options.views, options.seed)
    views = defaultdict(list)
    with open_context():
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform
        from envgen_usd.render.path_tracing.path_tracer import PathTracer  # noqa: PLC0415

        renderer = FrameRenderer(scene, pack(scene), camera)
        tracer = None
        for (number, pose), weather in product(enumerate(places.poses), WEATHERS):
            light = lights[weather]
            frame = renderer.draw(FrameRequest(pose, light))
            name = f"{path.parent.name}-{number}-{weather}-{options.samples}"
            file = kept(options.keep, name, pose, light)
            if file is not None and file.is_file():
                traced = np.load(file)
            else:
                tracer = tracer or PathTracer(scene, camera, options.samples)
                traced = tracer.radiance(pose, light)
                if file is not None:
                    np.save(file, traced)
            classes = masks(scene, frame.scene_objects, frame.depth)
            shadow, sunlit = np.zeros_like(classes["road"]), np.zeros_like(classes["road"])
            if light.sun.max() > 0.02 * light.sky.mean():
                alone = replace(light, sky=light.sky * np.float32(1e-6))
                shadow, sunlit = shares_of_sun(
                    renderer.draw(FrameRequest(pose, alone)).radiance, classes["road"]
                )
            drawn = frame.radiance
            if options.images is not None:
                options.images.mkdir(parents=True, exist_ok=True)
                both = np.hstack([ideal_picture(drawn), ideal_picture(traced)])
                write_png(options.images / f"{name}.png", both)
            classes["sky"] &= (drawn @ LUMINANCE) < DISC
            views[weather].append(
                View(drawn @ LUMINANCE, traced @ LUMINANCE, classes, shadow, sunlit)
            )
    return views


def joined(views: list[View], kind: str, where: str) -> np.ndarray:
    """Luminance of an engine at the pixels of a class in all views."""
    return np.concatenate([getattr(view, kind)[view.classes[where]] for view in views])


def contrast(views: list[View], kind: str) -> tuple[float, int]:
    """Mean ratio of shadow to sun on the road of the views that show both."""
    ratios = [
        getattr(view, kind)[view.shadow].mean() / getattr(view, kind)[view.sunlit].mean()
        for view in views
        if min(view.shadow.sum(), view.sunlit.sum()) >= 40
    ]
    return (float(np.mean(ratios)) if ratios else np.nan), len(ratios)


def levels(luminance: np.ndarray) -> np.ndarray:
    grey = np.repeat(luminance.astype(np.float32)[:, None], 3, axis=1)[None]
    return ideal_picture(grey)[0, :, 0].astype(float)


def report(weather: str, views: list[View]) -> None:
    print(f"\n{weather}, {len(views)} views\n\n| | drawn | traced | ratio |\n|---|---|---|---|")
    for name in CLASSES:
        drawn, traced = (joined(views, kind, name) for kind in ("drawn", "traced"))
        if len(drawn) < 100:
            continue
        row = drawn.mean(), traced.mean(), drawn.mean() / traced.mean()
        print(f"| {name} | {row[0]:.3f} | {row[1]:.3f} | {row[2]:.2f} |")
    dark, count = contrast(views, "drawn")
    dark_traced, _ = contrast(views, "traced")
    if count:
        print(f"| shadow / sun on the road ({count} views) | {dark:.3f} | {dark_traced:.3f}"
              f" | {dark / dark_traced:.2f} |")  # fmt: skip
    ratios = [
        joined(views, kind, "sky").mean() / joined(views, kind, "road").mean()
        for kind in ("drawn", "traced")
    ]
    print(f"| sky / road | {ratios[0]:.2f} | {ratios[1]:.2f} | {ratios[0] / ratios[1]:.2f} |")
    drawn, traced = (
        np.concatenate([levels(joined(views, kind, name)) for name in CLASSES])
        for kind in ("drawn", "traced")
    )
    print(f"\nhistogram distance (8-bit levels): {wasserstein_distance(drawn, traced):.1f};"
          f" mean level {drawn.mean():.0f} and {traced.mean():.0f}")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stages", type=Path, nargs="+")
    parser.add_argument("--views", type=int, default=5)
    parser.add_argument("--width", type=int, default=352)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder of traced images")
    parser.add_argument("--images", type=Path, help="folder of images, drawn and traced")
    options = parser.parse_args()
    together: dict[str, list[View]] = defaultdict(list)
    for stage in options.stages:
        for weather, views in draw_all(stage, options).items():
            together[weather] += views
    for weather, views in together.items():
        report(weather, views)


if __name__ == "__main__":
    main()
