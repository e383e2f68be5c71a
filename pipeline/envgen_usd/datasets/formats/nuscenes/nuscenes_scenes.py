"""Scenes and samples of nuScenes: the frames of drives, with times and tokens."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from envgen_usd.datasets.formats.nuscenes.nuscenes_tables import token
from envgen_usd.datasets.frame_files import FrameFiles

_BEGIN = 1_600_000_000_000_000
"""Time of the first sample of a take, microseconds."""
_KEY_FRAMES = 0.5
"""Time between samples without times of their own, seconds."""
_SCENE = 1_000_000_000
"""Microseconds from scene to scene of a take; scenes that last longer overlap."""


@dataclass(frozen=True)
class Sample:
    """The frames of all cameras at a pose of the vehicle.

    Attributes:
        frames: Frames, in the order of the cameras.
        time: Timestamp, microseconds.
    """

    frames: tuple[FrameFiles, ...]
    time: int

    @property
    def lead(self) -> FrameFiles:
        """Frame of the first camera."""
        return self.frames[0]

    @property
    def token(self) -> str:
        """Token of the sample."""
        return token("sample", take_of(self.lead), self.lead.frame.frame)


@dataclass(frozen=True)
class Scene:
    """Samples of a drive in a split.

    Attributes:
        name: ``scene-0001``, ...
        samples: Samples in the order of the drive.
    """

    name: str
    samples: tuple[Sample, ...]

    @property
    def first(self) -> FrameFiles:
        """First frame."""
        return self.samples[0].lead

    @property
    def token(self) -> str:
        """Token of the scene."""
        return token("scene", take_of(self.first), self.first.frame.frame)


def take_of(each: FrameFiles) -> str:
    """Town, weather and rig of a frame."""
    return "/".join(each.frame.folder.split("/")[1:3])


def channel_of(each: FrameFiles) -> str:
    """Channel of a camera: ``CAM_FRONT``, or ``CAM_`` before another name."""
    name = each.frame.camera.upper()
    return name if name.startswith("CAM_") else f"CAM_{name}"


def scenes_of(frames: Sequence[FrameFiles]) -> tuple[Scene, ...]:
    """Scenes of frames: consecutive frames of a take that share route and split."""
    takes: defaultdict[str, defaultdict[int, list[FrameFiles]]]
    takes = defaultdict(lambda: defaultdict(list))
    for each in frames:
        takes[take_of(each)][each.frame.frame].append(each)
    scenes: list[Scene] = []
    for take in takes.values():
        ordered = [tuple(take[number]) for number in sorted(take)]
        for number, (_, group) in enumerate(groupby(ordered, lambda shown: _drive(shown[0]))):
            samples = _timed(list(group), _BEGIN + number * _SCENE)
            scenes.append(Scene(f"scene-{len(scenes) + 1:04d}", samples))
    return tuple(scenes)


def _drive(each: FrameFiles) -> tuple[str, int, int]:
    row = each.pose_row
    return each.frame.split, row["route"], row.get("turn", 0)


def _timed(shown: Sequence[tuple[FrameFiles, ...]], begin: int) -> tuple[Sample, ...]:
    """Samples with their times: those of the drive, or half a second after each other."""
    times = [frames[0].pose_row.get("time") for frames in shown]
    first = times[0] or 0.0
    return tuple(
        Sample(
            frames, begin + round(1e6 * (number * _KEY_FRAMES if time is None else time - first))
        )
        for number, (frames, time) in enumerate(zip(shown, times, strict=True))
    )
