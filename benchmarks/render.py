"""Times the exporter by stage, and its peak memory.

    python benchmarks/render.py OUT/stage.usda --frames 20

Prints wall and processor seconds for reading the stage, packing it, the upload, and for each frame:
drawing by pass, the picture, label images and files. With `--cache`, the second run reads what the
first one has kept. The yardstick is a bare loop:
one depth-only draw of all triangles in the view. Processor seconds count all threads of the
process. A first frame, in which shaders are compiled, is drawn before.
"""

import argparse
import resource
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_response import camera_picture, draw_settings
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_folder import FrameFolder
from envgen_usd.render.frames.label_images import LabelPainter
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import Packed, pack
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.render.trajectories.trajectory import Trajectory, trajectory_poses

_EVERYWHERE = 1e6
"""Range that no part of a stage exceeds, metres."""


@contextmanager
def timed(name: str, laps: list[float] | None = None) -> Iterator[None]:
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    if laps is None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"{name:16s} {wall:8.2f} s wall {cpu:8.2f} s processor   {peak:5.2f} GB peak")
    else:
        laps.append(cpu)


def time_pass(owner: type, method: str, laps: list[float], finish: Callable[[], None]) -> None:
    """Makes a method note the processor time of its calls."""
    original = getattr(owner, method)

    def noted(*given: object, **named: object) -> object:
        finish()
        with timed("", laps):
            result = original(*given, **named)
            finish()
        return result

    setattr(owner, method, noted)


def time_passes(finish: Callable[[], None]) -> dict[str, list[float]]:
    from envgen_usd.render.drawing import label_pass, render_passes  # noqa: PLC0415 - binds the platform
    from envgen_usd.render.lighting import (  # noqa: PLC0415
        ambient_occlusion,
        height_map,
        shadow_maps,
    )

    passes = {
        "labels": (label_pass.LabelPass, "draw"),
        "shadow maps": (shadow_maps.ShadowMaps, "draw"),
        "height map": (height_map.HeightMap, "draw"),
        "occlusion": (ambient_occlusion.Occlusion, "draw"),
        "colour": (render_passes.FrameRenderer, "_draw_colour"),
        "edges": (render_passes.FrameRenderer, "_smooth_edges"),
    }
    laps: dict[str, list[float]] = {name: [] for name in passes}
    for name, (owner, method) in passes.items():
        time_pass(owner, method, laps[name], finish)
    return laps


def bare_loop(packed: Packed, scene: Scene, camera: Camera, poses: Sequence[Pose]) -> list[float]:
    """Processor seconds of a depth-only draw of all triangles in each view."""
    from OpenGL import GL as gl  # noqa: N811, PLC0415

    from envgen_usd.render.opengl import gpu  # noqa: PLC0415
    from envgen_usd.render.opengl.draw_list import DrawList  # noqa: PLC0415
    from envgen_usd.render.opengl.shader_looks import CutProgram, Looks  # noqa: PLC0415

    draws, looks = DrawList(packed, 5), Looks(scene.materials)
    programs = CutProgram("mesh.vert", "depth.frag")
    target = gpu.render_target((camera.width, camera.height), ())
    laps: list[float] = []
    for pose in (poses[0], *poses):
        with timed("", laps):
            clip, eye = camera.clip_matrix() @ np.linalg.inv(pose.matrix), pose.matrix[:3, 3]
            clip[:, 3] = clip @ [*eye, 1.0]
            draws.look_from(eye)
            target.bind()
            gl.glEnable(gl.GL_DEPTH_TEST)
            gl.glDepthFunc(gl.GL_GREATER)
            gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))
            programs.set(clip=clip, **looks.units, **draws.units)
            draws.draw(draws.inside(clip, eye), lambda m: looks.set_cut(programs, m))
            gl.glFinish()
    return laps[1:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stage", type=Path)
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--rig", default="kitti_360")
    parser.add_argument("--trajectory", choices=("spread", "drive"), default="spread")
    parser.add_argument("--spacing", type=float, default=10.0)
    parser.add_argument("--cache", action="store_true", help="read the stage as `render` does")
    parser.add_argument("--passes", action="store_true", help="wait for OpenGL after each pass")
    options = parser.parse_args()
    camera = read_rig(options.rig).camera[0]
    with timed("read stage"):
        stage = StageScene(options.stage, cache=options.cache)
        scene = stage.near(np.zeros((1, 3)), _EVERYWHERE)
    with timed("pack"):
        packed = pack(scene)
    corners = packed.commands["count"].astype(int) * packed.commands["instances"]
    print(
        f"{len(packed.indices) // 3:,} triangles stored, {corners.sum() // 3:,} with instances,"
        f" {len(packed.instances):,} instances, {len(scene.materials)} materials,"
        f" {len(scene.scene_objects):,} scene objects"
    )
    trajectory = Trajectory(options.trajectory, options.spacing)
    with timed("choose places"):
        poses = trajectory_poses(trajectory, scene, camera, options.frames, 0).poses
    laps: dict[str, list[float]] = {"draw": [], "picture": [], "files": []}
    with open_context() as renderer, tempfile.TemporaryDirectory() as out:
        from OpenGL import GL as gl  # noqa: N811, PLC0415 - binds the platform

        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415

        print(renderer)
        folder = FrameFolder(
            Path(out), full_ids=False, outputs=("rgb", "semantic", "instance", "depth")
        )
        folder.open("benchmark", camera.record(), poses, scene.scene_objects)
        painter = LabelPainter(scene.scene_objects)
        with timed("upload"):
            drawer = FrameRenderer(scene, packed, camera)
        drawer.draw(poses[0])
        passes = time_passes(gl.glFinish) if options.passes else {}
        with timed("all frames"):
            for number, pose in enumerate(poses):
                rng = np.random.default_rng(number)
                with timed("", laps["draw"]):
                    frame = drawer.draw(pose)
                with timed("", laps["picture"]):
                    rgb = camera_picture(frame.radiance, draw_settings(rng), rng)
                with timed("", laps["files"]):
                    images = painter.paint(frame.scene_objects)
                    folder.write(number, rgb, frame.depth, None, images)
        laps |= passes
        laps["bare loop"] = bare_loop(packed, scene, camera, poses)
    print("processor seconds of a frame: mean, median, largest")
    for name, values in laps.items():
        middle = statistics.median(values)
        print(f"{name:16s} {statistics.mean(values):8.3f} {middle:8.3f} {max(values):8.3f}")


if __name__ == "__main__":
    main()
