"""Scans of the lidars of a rig: place by place, beside the images."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.sensor_rig import Lidar, Rig
from envgen_usd.render.frames.frame_folder import LIDAR, SUFFIXES
from envgen_usd.render.frames.label_images import LabelPainter
from envgen_usd.render.frames.scan_folder import LidarChoice, ScanFolder
from envgen_usd.render.lidar.cut_outs import CutOuts
from envgen_usd.render.lidar.lidar_model import LidarModel, read_lidar_model
from envgen_usd.render.lidar.lidar_scan import Motion, scan
from envgen_usd.render.lidar.lidar_surfaces import SurfaceTable
from envgen_usd.render.lidar.moving_tree import MovingTrees
from envgen_usd.render.lidar.scan_files import KITTI, MOST_INSTANCES, SCAN_SUFFIXES
from envgen_usd.render.lidar.static_tree import StaticTree
from envgen_usd.render.lidar.tree_store import TreeStore
from envgen_usd.render.render_scene import Scene
from envgen_usd.render.stage.stage_scene import StageScene, cells
from envgen_usd.seeds import generator
from envgen_usd.step_clock import Progress

_NEAR_INFRARED = (800.0, 1000.0)
"""Wavelengths for which the reflectances of surfaces are good, nanometres."""
_CELL = 50.0
"""Side in metres of the squares whose scans share a tree.

A larger value builds fewer trees, each of more triangles. The squares are fixed in the world, so a
scan follows from its pose alone. A sensor that moves in a turn leaves its square by 2 m at most,
and so do the triangles at the end of its range.
"""


_Job: TypeAlias = tuple["LidarShot", int]


@dataclass(frozen=True)
class LidarShot:
    """The scans of a lidar of the rig.

    Attributes:
        lidar: The lidar.
        model: Its device.
        folder: Folder of its scans.
        poses: From the lidar's frame to the world, 4 x 4, for each frame.
        motions: Motion of the vehicle in each frame; `None` without.
        asked: Numbers of the frames to scan.
        times: Seconds since the start of the route, for each frame.
    """

    lidar: Lidar
    model: LidarModel
    folder: ScanFolder
    poses: Sequence[FloatArray]
    motions: Sequence[Motion | None]
    asked: Sequence[int]
    times: Sequence[float | None]

    def open(self, inputs: str) -> int:
        """Opens the folder; returns the number of scans of another run that it removed."""
        return self.folder.open(inputs, self.poses, self.times)

    def vehicle(self, number: int) -> FloatArray:
        """4 x 4, from the frame of the vehicle to the world in a frame."""
        vehicle: FloatArray = self.poses[number] @ np.linalg.inv(self.lidar.vehicle_from_lidar)
        return vehicle

    @cached_property
    def missing(self) -> tuple[int, ...]:
        """Numbers of the frames that were not there before this run."""
        return tuple(n for n in self.asked if not self.folder.has(n))


def rig_models(rig: Rig, name: str, outputs: Collection[str]) -> dict[str, LidarModel]:
    """Devices of the lidars of a rig, by the lidars' names; none if lidar is no output.

    Args:
        rig: The rig.
        name: Name of the rig, or its file, for errors.
        outputs: Kinds of outputs.

    Raises:
        EnvgenError: The rig has no lidar, or the device of a lidar is unknown.
    """
    if LIDAR not in outputs:
        return {}
    if not rig.lidar:
        raise EnvgenError(f"{name}: lidar: the rig has none; leave lidar out of the outputs")
    models = {}
    for number, each in enumerate(rig.lidar):
        if rig.is_single and each.name.casefold() in SUFFIXES:
            fault = f"{each.name} is the folder of a kind of image; choose another name"
            raise EnvgenError(f"{name}: lidar[{number}]: name: {fault}")
        try:
            models[each.name] = read_lidar_model(each.model)
        except EnvgenError as error:
            raise EnvgenError(f"{name}: lidar[{number}]: model: {error}") from error
    return models


def check_lidar_choice(choice: LidarChoice) -> None:
    """Checks the format.

    Raises:
        EnvgenError: The format is unknown.
    """
    if choice.format not in SCAN_SUFFIXES:
        known = ", ".join(SCAN_SUFFIXES)
        raise EnvgenError(f"render: unknown lidar format {choice.format}; known: {known}")


def lidar_shots(  # noqa: PLR0913, PLR0917 - what scans follow from
    rig: Rig,
    models: Mapping[str, LidarModel],
    folders: dict[str, ScanFolder],
    poses: Sequence[Pose],
    drawn: int,
    choice: LidarChoice,
    asked: Sequence[int],
) -> list[LidarShot]:
    """The scans of all lidars.

    Args:
        rig: The rig.
        models: Devices of the lidars, by name.
        folders: Folders of the lidars, by name.
        poses: Poses of the first camera; further ones may follow the frames.
        drawn: Number of frames.
        choice: Format and motion.
        asked: Numbers of the frames to scan.
    """
    from_vehicle = np.linalg.inv(rig.camera[0].vehicle_from_camera)
    shots = []
    for lidar in rig.lidar:
        if lidar.name not in models:
            continue
        placed = [pose.matrix @ from_vehicle @ lidar.vehicle_from_lidar for pose in poses]
        motions = _motions(poses, placed)[:drawn] if choice.motion else [None] * drawn
        folder, model = folders[lidar.name], models[lidar.name]
        times = [pose.time for pose in poses[:drawn]]
        shots.append(LidarShot(lidar, model, folder, placed[:drawn], motions, asked, times))
    return shots


def _motions(poses: Sequence[Pose], placed: Sequence[FloatArray]) -> list[Motion | None]:
    """Motion from each frame to the next of its drive; at its end, that of the frame before."""
    motions: list[Motion | None] = []
    for number, pose in enumerate(poses):
        pairs = ((number, number + 1), (number - 1, number))
        known = (pair for pair in pairs if _is_step(poses, *pair))
        first, last = next(known, (0, 0))
        if first == last or pose.time is None:
            motions.append(None)
            continue
        seconds = float(poses[last].time or 0.0) - float(poses[first].time or 0.0)
        motions.append(Motion.between(placed[first], placed[last], seconds))
    return motions


def _is_step(poses: Sequence[Pose], first: int, last: int) -> bool:
    """True if a frame follows another on one drive, later than it."""
    if first < 0 or last >= len(poses) or poses[first].route != poses[last].route:
        return False
    begin, end = poses[first].time, poses[last].time
    return begin is not None and end is not None and end > begin


def scan_issues(
    rig: Rig, scene: Scene, shots: Sequence[LidarShot], choice: LidarChoice
) -> list[Issue]:
    """What scans leave out."""
    if not rig.lidar:
        return []
    names = ", ".join(lidar.name for lidar in rig.lidar)
    if not shots:
        action = "they are recorded with their places; --outputs lidar scans them"
        return [Issue("render.lidar", Severity.INFO, names, "lidars are no output", action)]
    issues = []
    still = sum(motion is None for motion in shots[0].motions)
    if choice.motion and still:
        message = f"{still} of {len(shots[0].motions)} frames have no time or no neighbour"
        issues.append(
            Issue("render.lidar_motion", Severity.WARNING, names, message, "scanned at a moment")
        )
    beyond = sum(each.number > MOST_INSTANCES for each in scene.scene_objects)
    if choice.format == KITTI and beyond:
        message = f"{beyond} objects have numbers above {MOST_INSTANCES}, the most of .label files"
        action = "their instance is 0 there; npy and las hold them"
        issues.append(Issue("render.lidar_instances", Severity.WARNING, names, message, action))
    for shot in shots:
        length = shot.model.wavelength
        if length and not _NEAR_INFRARED[0] <= length <= _NEAR_INFRARED[1]:
            message = f"{shot.model.name} has {length:g} nm, and reflectances hold for 850 to 950"
            action = "intensities and detection are those of the near infrared"
            issues.append(
                Issue("render.lidar_wavelength", Severity.WARNING, shot.lidar.name, message, action)
            )
    return issues


def scan_counts(shots: Sequence[LidarShot]) -> dict[str, Any]:
    """Fields of a `RenderResult`: names of the lidars, scans of this run, scans before it."""
    scanned = sum(len(shot.missing) for shot in shots)
    return {
        "lidars": tuple(shot.lidar.name for shot in shots),
        "scanned": scanned,
        "scans_kept": sum(len(shot.asked) for shot in shots) - scanned,
    }


def scan_all(stage: StageScene, shots: Sequence[LidarShot], seed: int, progress: Progress) -> None:
    """Scans the missing frames, square by square; trees of meshes are built once.

    Args:
        stage: The stage.
        shots: Scans of each lidar.
        seed: Seed of the noise.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: embreex is missing, or a file cannot be written.
    """
    jobs = [(shot, number) for shot in shots for number in shot.missing]
    if not jobs:
        return
    scene = stage.scene
    surfaces, cut_outs = SurfaceTable(scene), CutOuts(scene.materials)
    painter = LabelPainter(scene.scene_objects)
    store = TreeStore()
    reach = max(shot.model.range for shot in shots)
    moved = MovingTrees(scene, reach, cut_outs)
    eyes = np.array([shot.poses[number][:3, 3] for shot, number in jobs])
    done = 0
    for cell in cells(eyes, _CELL):
        tree = square_tree(stage, eyes[cell], reach, cut_outs, store)
        for job in cell:
            progress("scan frames", done, len(jobs))
            shot, number = jobs[job]
            rng = generator(seed, "render", f"lidar {shot.lidar.name}", number)
            pose, motion = shot.poses[number], shot.motions[number]
            time, vehicle = shot.times[number], shot.vehicle(number)
            moment = stage.moving.at(time, vehicle) if stage.moving else None
            around = moved.beside(tree, moment, pose[:3, 3])
            scanned = scan(around, surfaces, shot.model, pose, rng, motion)
            shot.folder.write(number, scanned, painter, pose)
            done += 1
        del tree  # before the next one is built
    progress("scan frames", done, len(jobs))


def square_tree(
    stage: StageScene, eyes: FloatArray, reach: float, cut_outs: CutOuts, store: TreeStore
) -> StaticTree:
    """Tree of the square that holds sensors (N x 3)."""
    low = np.floor(eyes[0, :2] / _CELL) * _CELL
    square = np.stack((low, low + _CELL))
    corners = np.array([(x, y) for x in square[:, 0] for y in square[:, 1]])
    heights = np.repeat([eyes[:, 2].min(), eyes[:, 2].max()], 4)
    around = np.column_stack((np.tile(corners, (2, 1)), heights))
    return StaticTree(stage.near(around, reach + _CELL), square, reach, cut_outs, store)
