"""Times the exporter by stage, and its peak memory.

    python benchmarks/render.py OUT/stage.usda --frames 20

Prints wall and processor seconds for opening the stage, reading and packing it, the upload, each
frame, and each kind of image written. Processor seconds count all threads of the process.
"""

import argparse
import resource
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from envgen_usd.render.frame_folder import FrameFolder
from envgen_usd.render.gl_context import open_context
from envgen_usd.render.label_images import LabelPainter
from envgen_usd.render.scene_tiles import pack
from envgen_usd.render.sensor_rig import read_rig
from envgen_usd.render.stage_reader import open_stage, read_scene
from envgen_usd.render.trajectory import Trajectory, trajectory_poses


@contextmanager
def timed(name: str, laps: list[float] | None = None) -> Iterator[None]:
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    if laps is None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"{name:16s} {wall:8.2f} s wall {cpu:8.2f} s processor   {peak:5.2f} GB peak")
    else:
        laps.append(wall)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stage", type=Path)
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--spacing", type=float, default=10.0)
    options = parser.parse_args()
    camera = read_rig().camera[0]
    with timed("open stage"):
        stage = open_stage(options.stage)
    with timed("read scene"):
        scene = read_scene(stage)
    with timed("pack"):
        packed = pack(scene)
    corners = packed.commands["count"].astype(int) * packed.commands["instances"]
    print(
        f"{len(packed.indices) // 3:,} triangles stored, {corners.sum() // 3:,} with instances,"
        f" {len(packed.instances):,} instances, {len(scene.materials)} materials,"
        f" {len(scene.scene_objects):,} scene objects"
    )
    drive = Trajectory("drive", options.spacing)
    with timed("choose places"):
        poses = trajectory_poses(drive, scene, camera, options.frames, 0).poses
    draws: list[float] = []
    writes: list[float] = []
    with open_context() as renderer, tempfile.TemporaryDirectory() as out:
        from envgen_usd.render.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        print(renderer)
        folder = FrameFolder(Path(out), full_ids=False)
        folder.open("benchmark", camera.record(), poses, scene.scene_objects)
        painter = LabelPainter(scene.scene_objects)
        with timed("upload"):
            drawer = FrameRenderer(scene, packed, camera)
        with timed("all frames"):
            for number, pose in enumerate(poses):
                with timed("draw", draws):
                    frame = drawer.draw(pose)
                with timed("write", writes):
                    images = painter.paint(frame.scene_objects)
                    folder.write(number, frame.rgb, frame.depth, None, images)
    for name, laps in (("draw a frame", draws), ("write a frame", writes)):
        print(f"{name:16s} {statistics.median(laps):8.2f} s median {max(laps):8.2f} s at most")


if __name__ == "__main__":
    main()
