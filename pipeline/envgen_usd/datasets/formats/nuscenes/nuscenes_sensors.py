"""What the sensors of nuScenes' vehicle record: images and scans, with calibrations and poses."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.datasets.formats.nuscenes.nuscenes_scenes import Sample, Scene, channel_of, take_of
from envgen_usd.datasets.formats.nuscenes.nuscenes_tables import (
    category_index,
    linked,
    pose_record,
    token,
)
from envgen_usd.datasets.frame_files import FrameFiles, link_file
from envgen_usd.datasets.frame_scans import LidarFiles, Scan, lidars_of
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import FloatArray
from envgen_usd.whole_files import make_folder, write_whole

LIDARSEG = "lidarseg"
"""Folder and table of the points' classes."""
_OURS_FROM_NUSCENES = np.array(
    [(0.0, 1.0, 0.0, 0.0), (-1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)]
)
"""From nuScenes' axes of a lidar (x right, y ahead, z up) to ours (x ahead, y left, z up)."""
_TOP = "TOP"
"""The lidar of nuScenes' vehicle is ``LIDAR_TOP``."""
_INTENSITIES = 255.0
"""Intensity of a perfect white board in nuScenes."""


@dataclass(frozen=True)
class SensorData:
    """An image of a camera or a scan of a lidar.

    Attributes:
        sample: Its sample.
        channel: Channel of the sensor.
        modality: ``camera`` or ``lidar``.
        vehicle_from_sensor: 4 x 4.
        world_from_sensor: 4 x 4.
        height: Height of an image, pixels; 0 for a lidar.
        width: Width of an image, pixels; 0 for a lidar.
        intrinsics: 3 x 3 of a camera; empty for a lidar.
        lidar: The scans; `None` for a camera.
        image: The frame of a camera; `None` for a lidar.
    """

    sample: Sample
    channel: str
    modality: str
    vehicle_from_sensor: FloatArray
    world_from_sensor: FloatArray
    height: int = 0
    width: int = 0
    intrinsics: list[list[float]] = field(default_factory=list)
    lidar: LidarFiles | None = None
    image: FrameFiles | None = None

    @property
    def take(self) -> str:
        """Town, weather and rig."""
        return take_of(self.sample.lead)

    @property
    def number(self) -> int:
        """Number of the frame in its take."""
        return self.sample.lead.frame.frame

    @property
    def token(self) -> str:
        """Token of the record."""
        return token("sample_data", self.take, self.channel, self.number)

    @property
    def calibration(self) -> str:
        """Token of the calibrated sensor."""
        return token("calibrated_sensor", self.take, self.channel)

    @property
    def suffix(self) -> str:
        """Suffix of the file."""
        return "png" if self.lidar is None else "pcd.bin"

    @property
    def filename(self) -> str:
        """Path in the data set."""
        name = f"{self.take.replace('/', '_')}__{self.channel}__{self.sample.time}.{self.suffix}"
        return f"samples/{self.channel}/{name}"

    def record(self) -> dict[str, Any]:
        """Its row of `sample_data`, without `prev` and `next`."""
        return {
            "token": self.token,
            "sample_token": self.sample.token,
            "ego_pose_token": self.token,
            "calibrated_sensor_token": self.calibration,
            "timestamp": self.sample.time,
            "fileformat": "png" if self.lidar is None else "pcd",
            "is_key_frame": True,
            "height": self.height,
            "width": self.width,
            "filename": self.filename,
        }

    def ego_pose(self, origin: FloatArray) -> dict[str, Any]:
        """The pose of the vehicle, with x and y from the origin of the map."""
        vehicle = self.world_from_sensor @ np.linalg.inv(self.vehicle_from_sensor)
        vehicle[:2, 3] -= origin
        return {"token": self.token, "timestamp": self.sample.time, **pose_record(vehicle)}


def sensor_data(scene: Scene) -> list[SensorData]:
    """All images and scans of a scene, channel by channel."""
    of_channel: defaultdict[str, list[SensorData]] = defaultdict(list)
    for sample in scene.samples:
        for each in (*_images(sample), *_scans(sample)):
            of_channel[each.channel].append(each)
    return [each for rows in of_channel.values() for each in rows]


def sample_data_rows(data: Sequence[SensorData]) -> list[dict[str, Any]]:
    """Rows of `sample_data` of a scene, linked by channel."""
    of_channel: defaultdict[str, list[dict[str, Any]]] = defaultdict(list)
    for each in data:
        of_channel[each.channel].append(each.record())
    for rows in of_channel.values():
        linked(rows)
    return [row for rows in of_channel.values() for row in rows]


def sensor_rows(data: Sequence[SensorData]) -> dict[str, list[dict[str, Any]]]:
    """The tables `sensor` and `calibrated_sensor`."""
    first = {(each.take, each.channel): each for each in reversed(data)}
    modalities = {each.channel: each.modality for each in data}
    sensors = [
        {"token": token("sensor", channel), "channel": channel, "modality": modalities[channel]}
        for channel in sorted(modalities)
    ]
    calibrated = [
        {
            "token": each.calibration,
            "sensor_token": token("sensor", each.channel),
            **pose_record(each.vehicle_from_sensor),
            "camera_intrinsic": each.intrinsics,
        }
        for _, each in sorted(first.items(), key=lambda pair: pair[0])
    ]
    return {"sensor": sensors, "calibrated_sensor": calibrated}


def lidarseg_rows(data: Sequence[SensorData], version: str) -> list[dict[str, Any]]:
    """The table `lidarseg`: where the classes of a scan's points are."""
    return [
        {
            "token": each.token,
            "sample_data_token": each.token,
            "filename": f"{LIDARSEG}/{version}/{each.token}_lidarseg.bin",
        }
        for each in data
        if each.lidar is not None
    ]


def write_data(each: SensorData, out: Path, version: str) -> Scan | None:
    """Links an image, or writes a scan with the classes of its points and returns it.

    Raises:
        EnvgenError: The scan cannot be read, or a file cannot be written.
    """
    path = out / each.filename
    if each.image is not None:
        link_file(each.image.rgb, path)
    if each.lidar is None:
        return None
    scan = each.lidar.read(each.number)
    points = scan.points[:, :3] @ _OURS_FROM_NUSCENES[:3, :3].astype(np.float32)
    # Velodyne counts beams from the lowest.
    rings = each.lidar.lasers - 1 - scan.rings.astype(np.int64)
    rows = np.column_stack((points, scan.points[:, 3] * np.float32(_INTENSITIES), rings))
    make_folder(path.parent)
    write_whole(path, rows.astype("<f4").tobytes())
    indices = np.zeros(256, np.uint8)
    for entry in labels():
        indices[entry.id] = category_index(entry.name)
    folder = out / LIDARSEG / version
    make_folder(folder)
    write_whole(folder / f"{each.token}_lidarseg.bin", indices[scan.classes].tobytes())
    return scan


def remove_stale(rows: Sequence[Mapping[str, Any]], out: Path, version: str) -> None:
    """Removes the points' classes of an earlier run; the devkit compares their numbers."""
    kept = {out / row["filename"] for row in rows}
    for path in sorted((out / LIDARSEG / version).glob("*_lidarseg.bin")):
        if path not in kept:
            path.unlink()
    if not rows:
        (out / version / f"{LIDARSEG}.json").unlink(missing_ok=True)


def lidar_channels(names: Sequence[str]) -> list[str]:
    """Channels of the lidars of a rig: ``LIDAR_`` before the name.

    The devkit looks for boxes, poses and classes at ``LIDAR_TOP`` alone. Where no lidar has this
    name, the first is called so.
    """
    upper = [name.upper().removeprefix("LIDAR_") for name in names]
    if upper and _TOP not in upper:
        upper[0] = _TOP
    return [f"LIDAR_{name}" for name in upper]


def _images(sample: Sample) -> Iterator[SensorData]:
    for each in sample.frames:
        camera = each.cameras["camera"]
        fx, fy, cx, cy = (float(camera[key]) for key in ("fx", "fy", "cx", "cy"))
        yield SensorData(
            sample=sample,
            channel=channel_of(each),
            modality="camera",
            vehicle_from_sensor=np.array(each.cameras["vehicle_from_camera"], np.float64),
            world_from_sensor=np.array(each.pose_row["camera_to_world"], np.float64),
            height=camera["height"],
            width=camera["width"],
            intrinsics=[[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]],
            image=each,
        )


def _scans(sample: Sample) -> Iterator[SensorData]:
    lidars = lidars_of(sample.lead)
    for lidar, channel in zip(lidars, lidar_channels([e.name for e in lidars]), strict=True):
        yield SensorData(
            sample=sample,
            channel=channel,
            modality="lidar",
            vehicle_from_sensor=lidar.vehicle_from_lidar @ _OURS_FROM_NUSCENES,
            world_from_sensor=lidar.pose(sample.lead.frame.frame) @ _OURS_FROM_NUSCENES,
            lidar=lidar,
        )
