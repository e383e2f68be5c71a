"""Scans of lidars beside the frames of a data set."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.datasets.frame_files import FrameFiles
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR
from envgen_usd.render.frames.scan_folder import OBJECTS, SCANS
from envgen_usd.render.lidar.scan_files import KITTI, NPY, SCAN_SUFFIXES
from envgen_usd.render.render_scene import Floats


@dataclass(frozen=True, eq=False)
class Scan:
    """The points of a scan.

    Attributes:
        folder: Folder of the lidar.
        number: Number of the frame, from 0.
        points: N x 4: x ahead, y left, z up in the lidar's frame, metres; intensity, 0 to 1.
        classes: N, class ids as in semantic images, or the ids that were asked for.
        instances: N, values as in instance images: class id * 10,000,000 + n.
        rings: N, number of the laser, 0 is the uppermost.
        lidar_to_world: 4 x 4, from the lidar's frame to the world.
    """

    folder: Path
    number: int
    points: Floats
    classes: ByteArray
    instances: NDArray[np.uint32]
    rings: NDArray[np.uint16]
    lidar_to_world: FloatArray

    @property
    def world(self) -> FloatArray:
        """N x 3, the points in the world, metres, z up."""
        turn, place = self.lidar_to_world[:3, :3], self.lidar_to_world[:3, 3]
        points: FloatArray = self.points[:, :3].astype(np.float64) @ turn.T + place
        return points

    @property
    def objects(self) -> Mapping[int, str]:
        """Prim path by value of `instances`."""
        path = self.folder / OBJECTS / f"{self.number:06d}.json"
        return {int(value): str(prim) for value, prim in _table(path).items()}


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

    @property
    def lasers(self) -> int:
        """Number of lasers."""
        return len(self.record["model"]["elevations"])

    def pose(self, number: int) -> FloatArray:
        """4 x 4, from the lidar's frame to the world, of a frame."""
        return np.array(self.record["frames"][number]["lidar_to_world"], np.float64)

    def file(self, number: int, name: str = "points") -> Path:
        """Path of a file of a scan."""
        return self.folder / name / f"{number:06d}.{SCAN_SUFFIXES[self.format][name]}"

    def has(self, number: int) -> bool:
        """True if every file of a scan exists."""
        return all(self.file(number, name).is_file() for name in SCAN_SUFFIXES[self.format])

    def read(self, number: int) -> Scan:
        """Reads a scan.

        Raises:
            EnvgenError: The scans are LAS files, which hold the points in the world, or a file
                cannot be read.
        """
        check_scan_format(self.format, f"{self.folder}: ")
        path = self.file(number)
        try:
            columns = self._npy(path) if self.format == NPY else self._kitti(number)
        except (OSError, ValueError) as error:
            raise EnvgenError(f"{path}: cannot be read ({error}); scan the frame again") from error
        return Scan(self.folder, number, *columns, self.pose(number))

    @staticmethod
    def _npy(path: Path) -> tuple[Floats, ByteArray, NDArray[np.uint32], NDArray[np.uint16]]:
        rows = np.load(path)
        points = np.column_stack([rows[name] for name in ("x", "y", "z", "intensity")])
        return points, rows["semantic"], rows["instance"], rows["ring"]

    def _kitti(
        self, number: int
    ) -> tuple[Floats, ByteArray, NDArray[np.uint32], NDArray[np.uint16]]:
        points = np.fromfile(self.file(number), "<f4").reshape(-1, 4)
        words = np.fromfile(self.file(number, "labels"), "<u4")
        if len(words) != len(points):
            raise ValueError(f"{len(points)} points have {len(words)} labels")
        classes = (words & 0xFFFF).astype(np.uint8)
        instances = classes.astype(np.uint32) * np.uint32(INSTANCE_FACTOR) + (words >> 16)
        return points, classes, instances, self._rings(points)

    def _rings(self, points: Floats) -> NDArray[np.uint16]:
        """The laser of each point: that whose elevation is nearest.

        A laser keeps its elevation over the turn, and noise of ranges is along the beam.
        """
        elevations = np.array(self.record["model"]["elevations"], np.float64)
        up = np.degrees(np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])))
        between = (elevations[:-1] + elevations[1:]) / 2.0
        return np.searchsorted(-between, -up).astype(np.uint16)


def check_scan_format(name: str, place: str = "") -> None:
    """Checks that scans can be read.

    Args:
        name: Format of the scans.
        place: Begin of the error: where they are.

    Raises:
        EnvgenError: The format is LAS.
    """
    if name not in {KITTI, NPY}:
        fault = "other layouts, recordings and read_scans take lidar_format kitti or npy"
        raise EnvgenError(f"{place}{fault}, not {name}")


def lidars_of(each: FrameFiles) -> tuple[LidarFiles, ...]:
    """The lidars of a frame's take, by name."""
    take = each.root / Path(*Path(each.frame.folder).parts[:3])
    return tuple(lidar_files(path) for path in sorted(take.glob(f"*/{SCANS}")))


def lidar_files(path: Path) -> LidarFiles:
    """The scans of a lidar.

    Args:
        path: Its ``lidar.json``.

    Raises:
        EnvgenError: The file cannot be read.
    """
    return _lidar(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _lidar(path: Path, _changed: int) -> LidarFiles:
    """A lidar whose table was last changed at a time."""
    return LidarFiles(path.parent, _table(path))


def _table(path: Path) -> dict[str, Any]:
    try:
        content: dict[str, Any] = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise EnvgenError(f"{path}: cannot be read ({error}); scan the frames again") from error
    return content
