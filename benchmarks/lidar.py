"""CPU time of a lidar's scan by its parts, beside bare Embree on the same rays.

    python benchmarks/lidar.py town/stage.usda [--frames 6] [--columns 2048]

Prints, for the median scan: rays, hits (first hits and gaps in leaves), returns (noise, intensity,
labels) and files; then what the tree of a place takes, the first and the next time, and two
yardsticks: Embree alone on the same rays and tree, without gaps, and embreex on a wavy ground of a
million triangles.
"""

import argparse
import tempfile
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.label_images import LabelPainter
from envgen_usd.render.frames.scan_export import square_tree
from envgen_usd.render.frames.scan_folder import LidarChoice, ScanFolder
from envgen_usd.render.lidar.cut_outs import CutOuts
from envgen_usd.render.lidar.lidar_model import LidarModel, read_lidar_model
from envgen_usd.render.lidar.lidar_scan import rays, returns
from envgen_usd.render.lidar.lidar_surfaces import SurfaceTable
from envgen_usd.render.lidar.static_tree import StaticTree
from envgen_usd.render.lidar.tree_store import TreeStore
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.render.trajectories.trajectory import Trajectory, trajectory_poses

TIMES = defaultdict(list)


class timed:  # noqa: N801 - reads like a statement
    def __init__(self, name):
        self.name = name

    def __enter__(self):
        self.begin = time.process_time()

    def __exit__(self, *_):
        TIMES[self.name].append(1000.0 * (time.process_time() - self.begin))


def ground(size):
    """A wavy ground of 2 (size - 1)^2 triangles on 200 m x 200 m, below the sensor."""
    steps = np.linspace(-100.0, 100.0, size)
    x, y = np.meshgrid(steps, steps)
    points = np.stack((x, y, 2.0 * np.sin(x / 7.0) * np.cos(y / 9.0) - 3.0), axis=2)
    at = np.arange(size * size).reshape(size, size)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    halves = (np.stack(three, axis=2).reshape(-1, 3) for three in ((a, b, c), (a, c, d)))
    scene = EmbreeScene()
    TriangleMesh(scene, points.reshape(-1, 3).astype(np.float32), np.concatenate([*halves]))
    return scene


def shoot(name, scene, starts, ways, reach):
    for _ in range(9):
        lengths = np.full(len(ways), reach, np.float32)
        with timed(name):
            scene.run(starts, ways, dists=lengths, output=True)


def scan_place(
    stage: StageScene, model: LidarModel, pose: np.ndarray, tools, repeats: int
) -> StaticTree:
    surfaces, cut_outs, painter, folder, store = tools
    for name in ("tree of a place, first", "tree of a place, again"):
        with timed(name):
            tree = square_tree(stage, pose[None, :3, 3], model.range, cut_outs, store)
    for number in range(repeats):
        with timed("rays"):
            origins, ways = rays(model, pose, None)
        with timed("hits"):
            hits = tree.cast(origins, ways, model.range, model.neighbours)
        with timed("returns"):
            got = returns(hits, surfaces, model, np.random.default_rng(number))
        with timed("labels, files"):
            folder.write(number, got, painter, pose)
        TIMES["points"].append(len(got.points))
    starts = np.empty(ways.shape, np.float32)
    starts[:] = origins - tree.middle
    order = model.neighbours
    starts, ways = starts[order], ways[order]
    for _ in range(9):
        with timed("bare Embree, this tree"):
            tree.trees.first_hits(starts, ways, np.float32(model.range), coherent=True)
    return tree


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stage", type=Path)
    parser.add_argument("--frames", type=int, default=6, help="places")
    parser.add_argument("--repeats", type=int, default=5, help="scans at a place")
    parser.add_argument("--columns", type=int, default=2048)
    options = parser.parse_args()
    rig = read_rig("kitti_360_rig")
    model = replace(read_lidar_model("HDL-64E"), columns=options.columns)
    stage = StageScene(options.stage)
    lead = rig.reference
    poses = trajectory_poses(Trajectory("spread"), stage.scene, lead, options.frames, 0).poses
    with timed("surfaces and leaves, once"):
        tools = [SurfaceTable(stage.scene), CutOuts(stage.scene.materials)]
    tools.append(LabelPainter(stage.scene.scene_objects))
    with tempfile.TemporaryDirectory() as out:
        store = TreeStore()
        folder = ScanFolder(Path(out), rig.lidar[0], model, LidarChoice())
        folder.open("", [np.eye(4)], [None])
        from_vehicle = np.linalg.inv(lead.vehicle_from_camera)
        sizes = []
        for pose in poses:
            placed = pose.matrix @ from_vehicle @ rig.lidar[0].vehicle_from_lidar
            place = scan_place(stage, model, placed, (*tools, folder, store), options.repeats)
            sizes.append(place.triangles)
    ways = model.directions
    shoot("bare Embree, 10^6", ground(708), np.zeros_like(ways), ways, model.range)
    print(f"{len(model.elevations)} x {model.columns} rays, {len(poses)} places")
    print(f"triangles of a place: {min(sizes):,} to {max(sizes):,}")
    print(f"points of a scan:     {int(np.median(TIMES['points'])):,}")
    parts = ("rays", "hits", "returns", "labels, files")
    for name in parts:
        shown(name)
    totals = np.sum([TIMES[name] for name in parts], axis=0)
    print(f"{'a scan':26}{np.median(totals):8.1f} ms  ({totals.min():.1f} to {totals.max():.1f})")
    for name in ("bare Embree, this tree", "bare Embree, 10^6"):
        shown(name)
    shown("tree of a place, first")
    shown("tree of a place, again")
    shown("surfaces and leaves, once")


def shown(name: str) -> None:
    values = TIMES[name]
    print(f"{name:26}{np.median(values):8.1f} ms  ({min(values):.1f} to {max(values):.1f})")


if __name__ == "__main__":
    main()
