"""Times the exporter by stage, and its peak memory.

    python benchmarks/render.py OUT/stage.usda --frames 20

Prints wall and processor seconds for reading the stage, packing it, the upload, and for each frame:
the places of what moves, drawing by pass, the picture, label images and files. With `--cache`, the
second run reads what the first one has kept. The yardstick is a bare loop: one depth-only draw of
all triangles in the view. Processor seconds count all threads of the process. A first frame, in
which shaders are compiled, is drawn before. `--repeat` draws all frames again, with squares of the
height map kept from the first time.

`--pyrender 3` draws three of the frames with plain pyrender, too: all triangles of the stage
without textures, the shadows of the sun (`SHADOWS_DIRECTIONAL`), and two passes of labels (`SEG`).
"""

import argparse
import resource
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_response import camera_picture, draw_settings
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.sensor_rig import MountedCamera, read_rig
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.frames.frame_folder import FrameFolder
from envgen_usd.render.frames.label_images import LabelPainter
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import Packed, pack
from envgen_usd.render.render_scene import Moment, Scene
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
    from envgen_usd.render.drawing import (  # noqa: PLC0415 - binds the platform
        label_pass,
        partial_cover,
        render_passes,
    )
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
        "partial cover": (partial_cover.PartialCover, "draw"),
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

    draws, looks = DrawList(packed, 5), Looks(scene.materials, scene.textures)
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
            chosen = draws.inside(clip, eye) & draws.detailed(eye, camera.fx)
            draws.draw(chosen, lambda m: looks.set_cut(programs, m), alike=looks.alike)
            gl.glFinish()
    return laps[1:]


def moment_of(stage: StageScene, share: float) -> Moment | None:
    """Where moving bodies are after a share of the stage's range, as OpenUSD tells it."""
    moving = stage.moving
    return None if moving is None else moving.at(share * moving.clock.duration)


def shrunk(camera: MountedCamera, factor: int) -> MountedCamera:
    """The camera with pixels that are larger by a factor."""
    return replace(
        camera,
        width=camera.width // factor,
        height=camera.height // factor,
        fx=camera.fx / factor,
        fy=camera.fy / factor,
        cx=(camera.cx + 0.5) / factor - 0.5,
        cy=(camera.cy + 0.5) / factor - 0.5,
    )


def plain_pyrender(scene: Scene, camera: Camera, poses: Sequence[Pose]) -> list[float]:
    """Processor seconds of pyrender's colour, shadows, depth and two label images in each view.

    Each placed geometry is a node with all its instances, so that pyrender draws few calls: a node
    for each object, which the labels of instances would need, takes longer.
    """
    import pyrender  # noqa: PLC0415 - binds the platform

    world = pyrender.Scene(ambient_light=(0.3, 0.3, 0.3))
    colours = {}
    for number, use in enumerate(scene.uses):
        if use.level and use.level.far:
            continue
        geometry = scene.geometries[use.geometry]
        primitive = pyrender.Primitive(
            positions=geometry.points.astype(np.float32),
            normals=geometry.normals,
            indices=geometry.triangles.astype(np.uint32),
            poses=use.matrices.astype(np.float32),
        )
        node = world.add(pyrender.Mesh([primitive]))
        colours[node] = (number & 255, number >> 8 & 255, number >> 16)
    lens = camera.fx, camera.fy, camera.cx, camera.cy
    eye = world.add(pyrender.IntrinsicsCamera(*lens, znear=camera.near, zfar=2000.0))
    world.add(pyrender.DirectionalLight(intensity=3.0), pose=_towards(scene.light.sun_direction))
    renderer = pyrender.OffscreenRenderer(camera.width, camera.height)
    laps: list[float] = []
    for pose in (poses[0], *poses):
        world.set_pose(eye, pose.matrix @ np.diag([1.0, -1.0, -1.0, 1.0]))
        with timed("", laps):
            renderer.render(world, flags=pyrender.RenderFlags.SHADOWS_DIRECTIONAL)
            for _ in ("semantic", "instance"):
                renderer.render(world, flags=pyrender.RenderFlags.SEG, seg_node_map=colours)
    renderer.delete()
    return laps[1:]


def _towards(sun: FloatArray) -> FloatArray:
    """Pose whose z axis points to the sun: 4 x 4."""
    right = np.cross((0.0, 0.0, 1.0), sun)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack((right, np.cross(sun, right), sun), axis=1)
    return pose


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stage", type=Path)
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--rig", default="kitti_360")
    parser.add_argument("--trajectory", choices=("spread", "drive"), default="spread")
    parser.add_argument("--spacing", type=float, default=10.0)
    parser.add_argument("--cache", action="store_true", help="read the stage as `render` does")
    parser.add_argument("--passes", action="store_true", help="wait for OpenGL after each pass")
    parser.add_argument("--repeat", action="store_true", help="draw all frames a second time")
    parser.add_argument("--pyrender", type=int, default=0, metavar="N", help="frames of pyrender")
    parser.add_argument("--shrink", type=int, default=1, help="divide the camera's size by this")
    return parser.parse_args()


def main() -> None:
    options = arguments()
    camera = shrunk(read_rig(options.rig).camera[0], options.shrink)
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
    laps: dict[str, list[float]] = {"actors": [], "draw": [], "picture": [], "files": []}
    with open_context() as renderer, tempfile.TemporaryDirectory() as out:
        from OpenGL import GL as gl  # noqa: N811, PLC0415 - binds the platform

        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415

        print(renderer)
        folder = FrameFolder(Path(out), ("rgb", "semantic", "instance", "depth"))
        folder.open("benchmark", camera.record(), poses)
        painter = LabelPainter(scene.scene_objects)
        with timed("upload"):
            drawer = FrameRenderer(scene, packed, camera)
        drawer.draw(FrameRequest(poses[0]))
        passes = time_passes(gl.glFinish) if options.passes else {}
        with timed("all frames"):
            for number, pose in enumerate(poses):
                rng = np.random.default_rng(number)
                with timed("", laps["actors"]):
                    moment = moment_of(stage, number / len(poses))
                with timed("", laps["draw"]):
                    frame = drawer.draw(FrameRequest(pose, moment=moment))
                with timed("", laps["picture"]):
                    rgb = camera_picture(frame.radiance, draw_settings(rng), rng)
                with timed("", laps["files"]):
                    images = painter.paint(frame.scene_objects)
                    folder.write(number, rgb, frame.depth, None, images)
        laps |= {name: values.copy() for name, values in passes.items()}
        if options.repeat:
            laps["draw again"] = []
            for pose in poses:
                with timed("", laps["draw again"]):
                    drawer.draw(FrameRequest(pose))
        laps["bare loop"] = bare_loop(packed, scene, camera, poses)
    if options.pyrender:
        laps["pyrender"] = plain_pyrender(scene, camera, poses[: options.pyrender])
    print("processor seconds of a frame: mean, median, largest")
    for name, values in laps.items():
        middle = statistics.median(values)
        print(f"{name:16s} {statistics.mean(values):8.3f} {middle:8.3f} {max(values):8.3f}")


if __name__ == "__main__":
    main()
