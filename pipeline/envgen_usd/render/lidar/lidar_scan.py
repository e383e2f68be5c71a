"""A turn of a lidar: rays from where the vehicle is, and the points that come back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.lidar.lidar_model import LidarModel
from envgen_usd.render.lidar.lidar_surfaces import SurfaceTable
from envgen_usd.render.lidar.moving_tree import MomentTree
from envgen_usd.render.lidar.static_tree import Hits, StaticTree
from envgen_usd.render.render_scene import Floats

_THRESHOLD = 5.0
"""Signal from which a shot is detected, standard deviations of the receiver's noise.

A larger value detects fewer false points, of which there are none here, and blurs the limit less.
"""
_CERTAIN = 1.0 + 1.2816 / _THRESHOLD
"""Signal in thresholds that is detected with a probability of 90 %."""
_DIM = np.float32(0.1)
"""Reflectance of the target whose range a data sheet gives."""
_STEPS = np.float32(255.0)
"""Steps of the intensity: devices report 8 bits."""


@dataclass(frozen=True)
class LidarScan:
    """The points of a turn, by laser from the uppermost down, then by time.

    Attributes:
        points: N x 3, metres, in the lidar's frame when the shot was fired: x ahead, y left, z up.
        intensities: N, calibrated reflectance, 0 to 1: that of a board that faces the sensor;
            retro-reflectors have 1.
        rings: N, number of the laser, 0 is the uppermost.
        columns: N, number of the shot of the laser in the turn.
        times: N, seconds from the middle of the turn.
        scene_objects: N, index of the scene object.
    """

    points: Floats
    intensities: Floats
    rings: NDArray[np.uint16]
    columns: NDArray[np.uint16]
    times: Floats
    scene_objects: NDArray[np.uint32]


@dataclass(frozen=True)
class Motion:
    """How the vehicle moves on during a turn.

    Attributes:
        shift: 3, metres a second, world.
        spin: 3, rotation vector, radians a second, world.
    """

    shift: FloatArray
    spin: FloatArray

    @classmethod
    def between(cls, one: FloatArray, other: FloatArray, seconds: float) -> "Motion":
        """The motion that leads from a pose to another (4 x 4 each) in a time."""
        spin = Rotation.from_matrix(other[:3, :3] @ one[:3, :3].T).as_rotvec()
        return cls((other[:3, 3] - one[:3, 3]) / seconds, spin / seconds)


def scan(  # noqa: PLR0913, PLR0917 - what a scan follows from
    tree: StaticTree | MomentTree,
    surfaces: SurfaceTable,
    model: LidarModel,
    pose: FloatArray,
    rng: np.random.Generator,
    motion: Motion | None = None,
) -> LidarScan:
    """Fires all shots of a turn.

    Args:
        tree: What is around.
        surfaces: Its reflectance.
        model: The device.
        pose: 4 x 4, from the lidar's frame to the world in the middle of the turn.
        rng: Generator of the noise; each shot has its own figures, whatever others hit.
        motion: Motion of the vehicle; `None` for a turn at a moment, as after a compensation of the
            motion.
    """
    origins, directions = rays(model, pose, motion)
    hits = tree.cast(origins, directions, model.range, model.neighbours)
    return returns(hits, surfaces, model, rng)


def rays(model: LidarModel, pose: FloatArray, motion: Motion | None) -> tuple[FloatArray, Floats]:
    """Origins (3, or shots x 3) and directions (shots x 3) of all shots in the world."""
    if motion is None:
        turned = model.directions @ pose[:3, :3].T.astype(np.float32)
        return pose[:3, 3], np.ascontiguousarray(turned)
    axes = Rotation.from_rotvec(model.times[:, None] * motion.spin).as_matrix() @ pose[:3, :3]
    local = model.directions.reshape(-1, model.columns, 3)
    world = np.einsum("cij,rcj->rci", axes.astype(np.float32), local)
    places = pose[:3, 3] + model.times[:, None] * motion.shift
    origins = np.broadcast_to(places, (len(local), model.columns, 3))
    return origins.reshape(-1, 3), np.ascontiguousarray(world.reshape(-1, 3))


def returns(
    hits: Hits, surfaces: SurfaceTable, model: LidarModel, rng: np.random.Generator
) -> LidarScan:
    """What the receiver reports of the shots of a turn.

    The signal falls with the square of the range, and has Gaussian noise. A shot is detected above
    a threshold; the reported intensity is the signal without the fall with range.

    Args:
        hits: Hits of all shots, in the order of `LidarModel.directions`.
        surfaces: Reflectance.
        model: The device.
        rng: Generator.
    """
    noise = rng.standard_normal((2, model.shots), np.float32)
    lost = rng.random(model.shots, np.float32) < model.drop_out
    shots = np.flatnonzero(np.isfinite(hits.ranges) & ~lost)
    ranges, objects = hits.ranges[shots], hits.scene_objects[shots]
    share = surfaces.backscatter(objects, hits.materials[shots], hits.cosines[shots])
    fall = _DIM / np.float32(_CERTAIN) * np.square(ranges / np.float32(model.dim_range))
    seen = share + noise[0, shots] * (fall / np.float32(_THRESHOLD))
    reported = _measured(ranges, noise[1, shots], model)
    kept = (seen > fall) & (reported >= model.nearest) & (reported <= model.range)
    shots, reported = shots[kept], reported[kept]
    intensities = np.round(np.clip(seen[kept], 0.0, 1.0) * _STEPS) / _STEPS
    rings, columns = np.divmod(shots, model.columns)
    return LidarScan(
        points=model.directions[shots] * reported[:, None],
        intensities=intensities,
        rings=rings.astype(np.uint16),
        columns=columns.astype(np.uint16),
        times=model.times.astype(np.float32)[columns],
        scene_objects=objects[kept],
    )


def _measured(ranges: Floats, noise: Floats, model: LidarModel) -> Floats:
    """Ranges with noise, in steps of the device."""
    values: Floats = ranges + noise * np.float32(model.noise)
    if model.resolution:
        step = np.float32(model.resolution)
        values = np.round(values / step) * step
    return values
