"""How the frames of a drive are drawn: what any process needs for it, and what it draws."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from envgen_usd.light.weather import Weather
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.sensor_rig import MountedCamera, Rig
from envgen_usd.render.frames.film import Film
from envgen_usd.render.frames.frame_light import FrameLight, LightChoice
from envgen_usd.render.frames.rig_folder import RigFolder
from envgen_usd.render.frames.scan_export import LidarShot, lidar_shots, scan_all
from envgen_usd.render.frames.scan_folder import LidarChoice
from envgen_usd.render.frames.shot_drawing import Progress, draw_shots
from envgen_usd.render.frames.shots import Shot, shots_of
from envgen_usd.render.lidar.lidar_model import LidarModel
from envgen_usd.render.stage.stage_scene import StageScene


@dataclass(frozen=True)
class FrameRun:
    """What frames follow from besides the stage and their poses.

    It names no file but those of `out`, so that another machine needs only these and the stage.

    Attributes:
        out: Folder of the run.
        sensors: The rig.
        models: Devices of the lidars that are scanned, by the lidars' names.
        lidar: How they are scanned and written.
        light: What was asked of the light.
        weathers: The weathers of `light`, by name.
        response: ``camera`` or ``ideal``.
        engine: ``opengl`` or ``mitsuba``.
        seed: Random seed of the camera and the lidars.
        outputs: Kinds of outputs.
        reach: Range of what is drawn, metres.
    """

    out: Path
    sensors: Rig
    models: Mapping[str, LidarModel]
    lidar: LidarChoice
    light: LightChoice
    weathers: Mapping[str, Weather]
    response: str
    engine: str
    seed: int
    outputs: frozenset[str]
    reach: float

    @cached_property
    def folder(self) -> RigFolder:
        """The folder of the images and scans."""
        return RigFolder(self.out, self.sensors, self.outputs, self.models, self.lidar)


@dataclass(frozen=True)
class Drive:
    """The places of all frames.

    Attributes:
        poses: Poses of a camera of the rig; those beyond the drawn ones only end a motion.
        drawn: Number of frames.
        lead: The camera that the poses are of.
    """

    poses: Sequence[Pose]
    drawn: int
    lead: MountedCamera


@dataclass(frozen=True)
class Drawing:
    """Frames of a drive that a process draws.

    Attributes:
        run: What they follow from.
        opened: The stage.
        lights: Light of all frames.
        shots: Images of each camera.
        scans: Scans of each lidar.
    """

    run: FrameRun
    opened: StageScene
    lights: FrameLight
    shots: Sequence[Shot]
    scans: Sequence[LidarShot]

    @staticmethod
    def of(
        run: FrameRun,
        opened: StageScene,
        lights: FrameLight,
        drive: Drive,
        numbers: Collection[int],
    ) -> "Drawing":
        """Places the frames with the given numbers."""
        sensors, asked = run.sensors, sorted(numbers)
        shots = shots_of(run.folder, drive.poses, drive.drawn, drive.lead, asked)
        leads = sensors.camera_poses(sensors.camera[0], drive.poses, drive.lead)
        scans = lidar_shots(
            sensors, run.models, run.folder.scans, leads, drive.drawn, run.lidar, asked
        )
        return Drawing(run, opened, lights, shots, scans)

    @property
    def missing(self) -> list[int]:
        """Numbers of the frames of which an image or a scan was missing before this run."""
        images = {number for shot in self.shots for number in shot.missing}
        return sorted(images.union(*(scan.missing for scan in self.scans)))

    def draw(self, progress: Progress) -> str:
        """Draws and scans what is missing; returns the name of the renderer."""
        run = self.run
        film = Film(
            self.lights, run.sensors.camera[0], run.response, run.seed, run.outputs, run.engine
        )
        renderer = draw_shots(self.opened, run.reach, film, self.shots, progress)
        if self.scans:
            self.opened.forget()
        scan_all(self.opened, self.scans, run.seed, progress)
        return renderer
