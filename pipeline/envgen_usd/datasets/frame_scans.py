"""Scans of lidars beside the frames of a data set."""

import json
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.datasets.format_files import FrameFiles
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR
from envgen_usd.render.frames.scan_folder import SCANS
from envgen_usd.render.lidar.scan_files import KITTI, NPY, SCAN_SUFFIXES
from envgen_usd.render.render_scene import Floats


@dataclass(frozen=True)
class LidarFiles:
    """The scans of a lidar in a take.

    Attributes:
        folder: Folder of the lidar.
        record: Content of ``lidar.json``.
    """

    folder: Path
    record: dict[str, Any]

    @property
    def name(self) -> str:
        """Name of the lidar."""
        return str(self.record["name"])

    @property
    def format(self) -> str:
        """Format of the files."""
        return str(self.record["format"])

    @property
    def vehicle_from_lidar(self) -> FloatArray:
        """4 x 4, from the lidar's frame (x ahead, y left, z up) to the vehicle."""
        return np.array(self.record["vehicle_from_lidar"], np.float64)

    def pose(self, number: int) -> FloatArray:
        """4 x 4, from the lidar's frame to the world, of a frame."""
        return np.array(self.record["frames"][number]["lidar_to_world"], np.float64)

    def file(self, number: int, name: str = "points") -> Path:
        """Path of a file of a scan."""
        return self.folder / name / f"{number:06d}.{SCAN_SUFFIXES[self.format][name]}"

    def read(self, number: int) -> "FrameScan":
        """Reads a scan.

        Raises:
            EnvgenError: The scans are LAS files, which hold the points in the world.
        """
        if self.format == NPY:
            rows = np.load(self.file(number))
            points = np.column_stack([rows[axis] for axis in "xyz"])
            return FrameScan(
                points, rows["intensity"], rows["semantic"], rows["instance"], rows["ring"]
            )
        if self.format != KITTI:
            fault = "other layouts and recordings are written from the lidar_format kitti or npy"
            raise EnvgenError(f"{self.folder}: {fault}, not {self.format}")
        values = np.fromfile(self.file(number), "<f4").reshape(-1, 4)
        labels = np.fromfile(self.file(number, "labels"), "<u4")
        semantic = (labels & 0xFFFF).astype(np.uint8)
        instances = semantic.astype(np.uint32) * np.uint32(INSTANCE_FACTOR) + (labels >> 16)
        return FrameScan(values[:, :3], values[:, 3], semantic, instances, None)


@dataclass(frozen=True)
class FrameScan:
    """Points of a scan.

    Attributes:
        points: N x 3, the lidar's frame, metres.
        intensities: N, 0 to 1.
        semantic: N, class ids.
        instances: N, values as in instance images.
        rings: N, number of the beam; `None` where the files do not have it.
    """

    points: Floats
    intensities: Floats
    semantic: ByteArray
    instances: NDArray[np.uint32]
    rings: NDArray[np.uint16] | None

    @cached_property
    def counts(self) -> dict[int, int]:
        """Number of points of each instance."""
        values, counts = np.unique(self.instances, return_counts=True)
        pairs = zip(values.tolist(), counts.tolist(), strict=True)
        return {value: count for value, count in pairs if value % INSTANCE_FACTOR}


def lidars_of(each: FrameFiles) -> tuple[LidarFiles, ...]:
    """The lidars of a frame's take, by name."""
    take = each.root / Path(*Path(each.frame.folder).parts[:3])
    tables = sorted(take.glob(f"*/{SCANS}"))
    return tuple(_lidar(path, path.stat().st_mtime_ns) for path in tables)


@lru_cache(maxsize=64)
def _lidar(path: Path, _changed: int) -> LidarFiles:
    """A lidar whose table was last changed at a time."""
    return LidarFiles(path.parent, json.loads(path.read_text("utf-8")))
