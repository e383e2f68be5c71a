"""The folder of a lidar: its scans, their poses, and what they follow from."""

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.sensor_rig import Lidar
from envgen_usd.render.frames.frame_folder import read_table
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR, LabelPainter
from envgen_usd.render.frames.labels_json import labels_json
from envgen_usd.render.lidar.lidar_model import LidarModel
from envgen_usd.render.lidar.lidar_scan import LidarScan
from envgen_usd.render.lidar.scan_files import (
    KITTI,
    SCAN_SUFFIXES,
    PointLabels,
    write_scan,
)
from envgen_usd.whole_files import make_folder, write_whole

SCANS = "lidar.json"
"""File with the device and the poses."""
_FRAME = "x ahead, y left, z up, metres; the origin is where the beams begin"
OBJECTS = "objects"
"""Folder with the prim paths of instance values."""


@dataclass(frozen=True)
class LidarChoice:
    """How lidars are scanned and written.

    Attributes:
        format: ``kitti``, ``npy`` or ``las``.
        motion: True scans from where the vehicle is at each shot, as raw data are; False as if all
            shots of a turn were fired at once, as after a compensation of the motion.
    """

    format: str = KITTI
    motion: bool = False


class ScanFolder:
    """Scans of a lidar."""

    def __init__(self, path: Path, lidar: Lidar, model: LidarModel, choice: LidarChoice) -> None:
        """Sets the folder; no file is created yet."""
        self._path, self._lidar, self._model, self._choice = path, lidar, model, choice
        self._suffixes = SCAN_SUFFIXES[choice.format]

    def open(self, inputs: str, poses: Sequence[FloatArray], times: Sequence[float | None]) -> int:
        """Prepares the folder; scans of the same inputs, device and poses are kept.

        Args:
            inputs: Identifies the stage and the settings: their `fingerprint`.
            poses: From the lidar's frame to the world for each frame, 4 x 4 each.
            times: Seconds since the start of each frame's route.

        Returns:
            Number of removed scans.

        Raises:
            EnvgenError: The folder cannot be written.
        """
        frames = [
            {
                "frame": number,
                **({} if time is None else {"time": round(time, 6)}),
                "lidar_to_world": pose.tolist(),
            }
            for number, (pose, time) in enumerate(zip(poses, times, strict=True))
        ]
        earlier = read_table(self._path / SCANS)
        listed: list[Any] = earlier.get("frames", [])
        common = min(len(listed), len(frames))
        removed, mark = 0, self._mark(inputs)
        if earlier.get("fingerprint") != mark or listed[:common] != frames[:common]:
            removed, listed = clear_scans(self._path), []
        for name in (*self._suffixes, OBJECTS):
            make_folder(self._path / name)
        content = self._record() | {"fingerprint": mark, "inputs": inputs}
        content["frames"] = max(listed, frames, key=len)
        write_whole(self._path / SCANS, json.dumps(content, indent=1) + "\n")
        write_whole(self._path / "labels.json", labels_json())
        return removed

    def has_tables(self) -> bool:
        """True if the files exist that belong to all scans."""
        return all((self._path / name).is_file() for name in (SCANS, "labels.json"))

    def has(self, number: int) -> bool:
        """True if every file of a scan exists; each is written whole or not at all."""
        return all(path.is_file() for path in self._files(number).values())

    def write(self, number: int, scan: LidarScan, painter: LabelPainter, pose: FloatArray) -> None:
        """Writes a scan.

        Args:
            number: Number of the frame.
            scan: Points.
            painter: Labels of the scene objects.
            pose: 4 x 4, from the lidar's frame to the world.
        """
        files = self._files(number)
        instances = painter.values[scan.scene_objects]
        seen = [value for value in np.unique(instances).tolist() if value % INSTANCE_FACTOR]
        named = {str(value): painter.paths[value] for value in seen}
        write_whole(files.pop(OBJECTS), json.dumps(named, indent=1) + "\n")
        labels = PointLabels(
            semantic=painter.ids[scan.scene_objects],
            part=painter.parts[scan.scene_objects],
            instance=instances,
            factor=INSTANCE_FACTOR,
        )
        write_scan(files, self._choice.format, scan, labels, pose)

    def _files(self, number: int) -> dict[str, Path]:
        suffixes = {**self._suffixes, OBJECTS: "json"}
        return {
            name: self._path / name / f"{number:06d}.{suffix}" for name, suffix in suffixes.items()
        }

    def _mark(self, inputs: str) -> str:
        figures = json.dumps(self._record(), sort_keys=True)
        return hashlib.sha256(f"{inputs} {figures}".encode()).hexdigest()

    def _record(self) -> dict[str, Any]:
        return {
            "name": self._lidar.name,
            "model": asdict(self._model),
            "axes": _FRAME,
            "vehicle_from_lidar": self._lidar.vehicle_from_lidar.tolist(),
            **asdict(self._choice),
        }


def clear_scans(path: Path) -> int:
    """Removes all scans of a folder, and returns their number."""
    (path / SCANS).unlink(missing_ok=True)
    numbers = set()
    for name, suffix in _every_file():
        for file in (path / name).glob("[0-9]" * 6 + f".{suffix}"):
            numbers.add(file.stem)
            file.unlink()
        with suppress(OSError):
            (path / name).rmdir()
    return len(numbers)


def clear_other_scans(out: Path, inputs: str, kept: Collection[str]) -> int:
    """Removes the scans that an earlier run of other inputs or of other lidars wrote.

    Args:
        out: Folder of the run.
        inputs: Identifies the stage and the settings of this run.
        kept: Names of the lidars of the rig.

    Returns:
        Number of removed scans.
    """
    removed = 0
    for table in sorted(out.glob(f"*/{SCANS}")):
        folder = table.parent
        if folder.name not in kept or read_table(table).get("inputs") != inputs:
            removed += clear_scans(folder)
            (folder / "labels.json").unlink(missing_ok=True)
            with suppress(OSError):
                folder.rmdir()
    return removed


def _every_file() -> set[tuple[str, str]]:
    kinds: list[Mapping[str, str]] = list(SCAN_SUFFIXES.values())
    return {pair for kind in kinds for pair in kind.items()} | {(OBJECTS, "json")}
