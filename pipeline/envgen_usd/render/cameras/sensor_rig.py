"""Sensors of a vehicle: cameras and lidars with their places, read from a rig file."""

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from msgspec import Meta

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, on_grid
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.toml_files import is_there, read_toml

DEFAULT_RIG = "kitti_360"
VEHICLE_FRAME = (
    "ISO 8855: x ahead, y left, z up, metres; the origin is on the road below the middle of the"
    " rear axle"
)
WHEELBASE = 2.7
"""Wheelbase over which the car takes its heading and pitch from the road, metres.

A larger value smooths both.
"""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_BODY_FROM_CAMERA = np.array([(0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)])
"""From camera axes (x right, y down, z forward) to body axes (x ahead, y left, z up)."""

Length: TypeAlias = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
Angle: TypeAlias = Annotated[float, Meta(ge=-360.0, le=360.0)]
Position: TypeAlias = tuple[Length, Length, Length]
Rotation: TypeAlias = tuple[Angle, Angle, Angle]


@dataclass(frozen=True)
class MountedCamera(Camera):
    """A camera with its place on the vehicle.

    Attributes:
        name: Name of the camera, of its folder and of its prim.
        position: Position in the vehicle frame, metres; `None` for a camera in the middle of the
            vehicle, `mount` metres above the road.
        rotation: Roll, pitch and yaw in degrees (ISO 8855): about x, the new y and the new z of
            the vehicle in the order yaw, pitch, roll. A pitch above 0 looks down, a yaw above 0 to
            the left.
    """

    name: str = "camera"
    position: Position | None = None
    rotation: Rotation = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Checks the name."""
        _check_name(self.name)

    @property
    def vehicle_from_camera(self) -> FloatArray:
        """4 x 4, from camera space to the vehicle frame."""
        place = _placed(self.position or (WHEELBASE / 2, 0.0, self.mount), self.rotation)
        place[:3, :3] = place[:3, :3] @ _BODY_FROM_CAMERA
        return place

    def record(self) -> dict[str, Any]:
        """Name, intrinsics, lens, meaning of depth and place, as ``cameras.json`` records them."""
        along = "from the camera" if self.lens.has_ranges else "along the optical axis"
        figures = asdict(self)
        return {
            "name": self.name,
            "camera": {field.name: figures[field.name] for field in fields(Camera)},
            "depth": f"metres {along}; 0 where nothing is seen",
            "vehicle_from_camera": self.vehicle_from_camera.tolist(),
        }


@dataclass(frozen=True)
class Lidar:
    """A lidar with its place on the vehicle.

    Attributes:
        name: Name of the lidar and of its prim.
        position: Position in the vehicle frame, metres.
        rotation: Roll, pitch and yaw in degrees, as of a `MountedCamera`.
        model: Name of a shipped device, or a TOML file, relative to that of the rig.
    """

    name: str
    position: Position
    rotation: Rotation = (0.0, 0.0, 0.0)
    model: str = ""

    def __post_init__(self) -> None:
        """Checks the name."""
        _check_name(self.name)

    @property
    def device(self) -> str:
        """Name of the device, or of its file: the folder of that file says nothing to others."""
        return Path(self.model).name

    @property
    def vehicle_from_lidar(self) -> FloatArray:
        """4 x 4, from the lidar's frame (x ahead, y left, z up) to the vehicle frame."""
        return _placed(self.position, self.rotation)


@dataclass(frozen=True)
class Rig:
    """The sensors of a vehicle.

    Attributes:
        camera: Cameras; the first leads the poses.
        lidar: Lidars; the output ``lidar`` scans them.
        headlamps: Places of the vehicle's headlamps in the vehicle frame, metres; empty for a
            vehicle without light. They are lit in the dark.
    """

    camera: tuple[MountedCamera, ...] = ()
    lidar: tuple[Lidar, ...] = ()
    headlamps: Annotated[tuple[Position, ...], Meta(max_length=2)] = (
        (3.5, 0.6, 0.65),
        (3.5, -0.6, 0.65),
    )

    def __post_init__(self) -> None:
        """Checks that there is a camera, and that names differ."""
        if not self.camera:
            raise ValueError("camera: expected at least one camera; add a [[camera]] table")
        seen: dict[str, str] = {}
        for key in ("camera", "lidar"):
            for number, sensor in enumerate(getattr(self, key)):
                place, folded = f"{key}[{number}]", sensor.name.casefold()
                if folded in seen:
                    message = f"{place}: name: {sensor.name} is the name of {seen[folded]}, too"
                    raise ValueError(message)
                seen[folded] = place

    @property
    def is_single(self) -> bool:
        """True if the rig has a single camera."""
        return len(self.camera) == 1

    @cached_property
    def reference(self) -> MountedCamera:
        """Camera whose poses a trajectory gives.

        It is in the middle of the vehicle, looks ahead, and is as high as the first camera.
        """
        height = float(self.camera[0].vehicle_from_camera[2, 3])
        return replace(self.camera[0], position=None, rotation=(0.0, 0.0, 0.0), mount=height)

    def eyes(self, lead: MountedCamera) -> FloatArray:
        """Positions of all cameras in the space of a leading camera: C x 3."""
        from_vehicle = np.linalg.inv(lead.vehicle_from_camera)
        return np.array([(from_vehicle @ c.vehicle_from_camera)[:3, 3] for c in self.camera])

    def camera_poses(
        self, camera: MountedCamera, poses: Sequence[Pose], lead: MountedCamera
    ) -> tuple[Pose, ...]:
        """Poses of a camera for poses of a leading camera, on the grid of camera positions."""
        offset = np.linalg.inv(lead.vehicle_from_camera) @ camera.vehicle_from_camera
        if np.allclose(offset, np.eye(4), rtol=0.0, atol=1e-12):
            return tuple(poses)
        return tuple(_moved(pose, offset) for pose in poses)

    def record(self) -> dict[str, Any]:
        """The sensors as ``cameras.json`` records them."""
        cameras = [camera.record() for camera in self.camera]
        lamps = {"headlamps": [list(place) for place in self.headlamps]}
        return {
            "vehicle": VEHICLE_FRAME,
            "cameras": cameras,
            "lidars": self.lidar_records(),
        } | lamps

    def lidar_records(self) -> list[dict[str, Any]]:
        """The lidars as ``cameras.json`` records them."""
        return [
            {
                "name": lidar.name,
                "model": lidar.device,
                "vehicle_from_lidar": lidar.vehicle_from_lidar.tolist(),
            }
            for lidar in self.lidar
        ]


def is_name(name: str) -> bool:
    """True if a sensor can have this name."""
    return _NAME.fullmatch(name) is not None


def _moved(pose: Pose, offset: FloatArray) -> Pose:
    matrix = pose.matrix @ offset
    matrix[:3, 3] = on_grid(matrix[:3, 3])
    return replace(pose, matrix=matrix)


def read_rig(name: str = DEFAULT_RIG) -> Rig:
    """Reads a shipped rig by name, or a TOML file.

    Raises:
        EnvgenError: The rig does not exist, or a value of its file is missing or unknown.
    """
    folder = resources.files("envgen_usd.renders") / "rigs"
    path = Path(name) if name.endswith(".toml") else folder / f"{name}.toml"
    if not is_there(path):
        known = ", ".join(sorted(f.name.removesuffix(".toml") for f in folder.iterdir()))
        raise EnvgenError(f"render: unknown rig {name}; known: {known}, or a .toml file")
    rig = read_toml(path, Rig)
    return replace(rig, lidar=tuple(_with_path(each, path) for each in rig.lidar))


def _with_path(lidar: Lidar, rig: Path | Traversable) -> Lidar:
    """The file of a device is relative to that of its rig."""
    if not lidar.model.endswith(".toml"):
        return lidar
    return replace(lidar, model=str(Path(str(rig)).absolute().parent / lidar.model))


def shipped_rigs() -> dict[str, Rig]:
    """The shipped rigs by their names, sorted."""
    folder = resources.files("envgen_usd.renders") / "rigs"
    names = sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name[-5:] == ".toml")
    return {name: read_rig(name) for name in names}


def _check_name(name: str) -> None:
    if not is_name(name):
        raise ValueError(f"name: expected letters, digits and _, not {name!r}")


def _placed(position: Position, rotation: Rotation) -> FloatArray:
    """4 x 4, from body axes to the vehicle frame."""
    roll, pitch, yaw = np.radians(rotation)
    (cr, cp, cy), (sr, sp, sy) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    about_x = np.array([(1.0, 0.0, 0.0), (0.0, cr, -sr), (0.0, sr, cr)])
    about_y = np.array([(cp, 0.0, sp), (0.0, 1.0, 0.0), (-sp, 0.0, cp)])
    about_z = np.array([(cy, -sy, 0.0), (sy, cy, 0.0), (0.0, 0.0, 1.0)])
    place = np.eye(4)
    place[:3, :3] = about_z @ about_y @ about_x
    place[:3, 3] = position
    return place
