"""The frames of a camera of a rig: their poses, their files, and those that are missing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.sensor_rig import MountedCamera
from envgen_usd.render.frames.frame_folder import FrameFolder, camera_mark
from envgen_usd.render.frames.rig_folder import RigFolder
from envgen_usd.render.lighting.headlamps import Headlamps, headlamps_at


@dataclass(frozen=True)
class Shot:
    """The frames of a camera of the rig.

    Attributes:
        camera: The camera.
        folder: Where its images are.
        poses: Its pose in each frame of the drive.
        lamps: Places of the headlamps in the vehicle, N x 3, metres.
        asked: Numbers of the frames to draw.
        beyond: Its pose after the last frame; `None` if the drive is not known to go on.
    """

    camera: MountedCamera
    folder: FrameFolder
    poses: Sequence[Pose]
    lamps: FloatArray
    asked: Sequence[int]
    beyond: Pose | None

    def following(self, number: int) -> Pose | None:
        """Pose of the next frame of the drive; `None` at its end."""
        ahead = [*self.poses[number + 1 : number + 2], *filter(None, [self.beyond])]
        route = self.poses[number].route
        return ahead[0] if ahead and ahead[0].route == route else None

    def headlamps(self, number: int) -> Headlamps:
        """Headlamps of the vehicle in a frame."""
        return headlamps_at(self.lamps, self.vehicle(self.poses[number]))

    def vehicle(self, pose: Pose) -> FloatArray:
        """4 x 4, from the frame of the vehicle to the world, for a pose of the camera."""
        vehicle: FloatArray = pose.matrix @ np.linalg.inv(self.camera.vehicle_from_camera)
        return vehicle

    def open(self, rig: RigFolder, mark: str, records: Sequence[Mapping[str, object]]) -> int:
        """Opens the folder; returns the number of frames of another run that it removed."""
        return self.folder.open(
            camera_mark(mark, self.camera),
            rig.calibration(self.camera),
            self.poses,
            records,
        )

    @cached_property
    def missing(self) -> tuple[int, ...]:
        """Numbers of the frames that were not there before this run."""
        return tuple(n for n in self.asked if not self.folder.has(n))


def shots_of(
    rig: RigFolder,
    poses: Sequence[Pose],
    drawn: int,
    lead: MountedCamera,
    asked: Sequence[int],
) -> list[Shot]:
    """Places the frames of all cameras of a rig.

    Args:
        rig: Folder of the rig.
        poses: Poses of a camera of the rig; those beyond the drawn ones only end a motion.
        drawn: Number of frames of the drive.
        lead: The camera that the poses are of.
        asked: Numbers of the frames to draw.
    """
    lamps = np.array(rig.sensors.headlamps, np.float64).reshape(-1, 3)
    images = asked if rig.has_images else ()
    shots = []
    for camera in rig.sensors.camera:
        placed = rig.sensors.camera_poses(camera, poses, lead)
        beyond = placed[drawn] if len(placed) > drawn else None
        shots.append(Shot(camera, rig.frames_of(camera), placed[:drawn], lamps, images, beyond))
    return shots
