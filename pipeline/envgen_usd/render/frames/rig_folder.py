"""The folder of a run: a folder of frames for each camera of a rig, and what all share."""

import json
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.sensor_rig import VEHICLE_FRAME, MountedCamera, Rig, is_name
from envgen_usd.render.frames.frame_folder import SUFFIXES, FrameFolder, read_table
from envgen_usd.render.frames.rig_layer import write_rig_layer
from envgen_usd.render.frames.scan_folder import LidarChoice, ScanFolder, clear_other_scans
from envgen_usd.render.lidar.lidar_model import LidarModel
from envgen_usd.render.stage.stage_clock import StageClock
from envgen_usd.whole_files import remove_abandoned, write_whole

LAYER = "cameras.usda"
"""Name of the USD layer with the sensors of a run."""


class RigFolder:
    """Frames of all cameras of a rig, and scans of its lidars.

    A rig with a single camera has its images in the folder itself. Several cameras have a folder
    each, by their names; so has each lidar.

    Attributes:
        scans: Folders of the lidars that are scanned, by name.
        has_images: True if images are wanted, not scans alone.
    """

    def __init__(
        self,
        path: Path,
        rig: Rig,
        outputs: Collection[str],
        models: Mapping[str, LidarModel] | None = None,
        lidar: LidarChoice = LidarChoice(),  # noqa: B008 - is frozen
    ) -> None:
        """Sets the folders; no file is created yet.

        Args:
            path: The folder.
            rig: The rig.
            outputs: Kinds of outputs.
            models: Devices of the lidars that are scanned, by the lidars' names.
            lidar: How they are scanned and written.
        """
        self._path, self._rig = path, rig
        self.has_images = bool(set(outputs) & SUFFIXES.keys())
        self.scans = {
            each.name: ScanFolder(path / each.name, each, models[each.name], lidar)
            for each in rig.lidar
            if models and each.name in models
        }
        self._folders = {
            camera.name: FrameFolder(path if rig.is_single else path / camera.name, outputs)
            for camera in rig.camera
        }

    @property
    def sensors(self) -> Rig:
        """The rig."""
        return self._rig

    def frames_of(self, camera: MountedCamera) -> FrameFolder:
        """Folder of a camera's frames."""
        return self._folders[camera.name]

    def has_tables(self) -> bool:
        """True if the files exist that belong to all frames, of the rig and of its sensors."""
        own = {LAYER} if self._rig.is_single else {LAYER, "cameras.json"}
        scans = all(folder.has_tables() for folder in self.scans.values())
        images = all(folder.has_tables() for folder in self._folders.values())
        return scans and images and all((self._path / name).is_file() for name in own)

    def has(self, number: int) -> bool:
        """True if every file of a frame exists, of all cameras and lidars."""
        scans = all(folder.has(number) for folder in self.scans.values())
        return scans and all(folder.has(number) for folder in self._folders.values())

    def calibration(self, camera: MountedCamera) -> dict[str, Any]:
        """What the folder of a camera records of it."""
        lidars = self._rig.lidar_records() if self._rig.is_single else []
        shared = {"vehicle": VEHICLE_FRAME} | ({"lidars": lidars} if lidars else {})
        return camera.record() | shared

    def remove_others(self, inputs: str) -> int:
        """Removes the frames of sensors that the rig does not have; returns their number.

        What killed processes left of files that they were writing is removed, too.

        Args:
            inputs: Identifies the stage and the settings; scans of others are removed.

        Raises:
            EnvgenError: The folder cannot be written.
        """
        names = [each.name for each in self._rig.lidar]
        remove_abandoned(self._path)
        try:
            removed = sum(FrameFolder(folder).clear() for folder in self._others())
            return removed + clear_other_scans(self._path, inputs, names)
        except OSError as error:
            raise EnvgenError(
                f"render: {self._path} cannot be written: {error.strerror}"
            ) from error

    def _others(self) -> list[Path]:
        """Folders that an earlier run with other cameras wrote."""
        earlier = read_table(self._path / "cameras.json").get("cameras", [])
        names = [str(row.get("name")) for row in earlier if isinstance(row, dict)]
        kept = () if self._rig.is_single else tuple(self._folders)
        others = [self._path / name for name in names if is_name(name) and name not in kept]
        return others if self._rig.is_single else [self._path, *others]

    def record(self, stage: Usd.Stage, clock: StageClock | None = None) -> None:
        """Writes ``cameras.usda``, and for several cameras their common ``cameras.json``.

        Args:
            stage: The stage.
            clock: Times of a stage where something moves.

        Raises:
            EnvgenError: The folder cannot be written.
        """
        first = self._rig.camera[0]
        rows = self._folders[first.name].rows()
        from_vehicle = np.linalg.inv(first.vehicle_from_camera)
        vehicle = [np.array(row["camera_to_world"]) @ from_vehicle for row in rows]
        try:
            codes = _codes(rows, clock) if clock else []
            write_rig_layer(self._path / LAYER, stage, self._rig, vehicle, codes)
            if not self._rig.is_single:
                write_whole(self._path / "cameras.json", self._table(rows, vehicle))
        except OSError as error:
            raise EnvgenError(
                f"render: {self._path} cannot be written: {error.strerror}"
            ) from error

    def _table(self, rows: list[Mapping[str, Any]], vehicle: list[FloatArray]) -> str:
        frames = [
            dict(row) | {"vehicle_to_world": matrix.tolist()}
            for row, matrix in zip(rows, vehicle, strict=True)
        ]
        content = self._rig.record() | {
            "lead": self._rig.camera[0].name,
            "frames": frames,
        }
        return json.dumps(content, indent=1) + "\n"


def _codes(rows: Sequence[Mapping[str, Any]], clock: StageClock) -> list[float]:
    """Time codes of frames of a drive on the stage; none if their times do not grow."""
    times = [row.get("time") for row in rows]
    known = [time for time in times if time is not None]
    if len(known) < len(times) or any(one >= other for one, other in pairwise(known)):
        return []
    return [clock.start + time * clock.rate for time in known]
