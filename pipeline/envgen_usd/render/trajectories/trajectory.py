"""Where frames are: the poses of a trajectory, without places where a camera cannot be."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from typing import TypeAlias

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_clearance import REACH, refused_places
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.render_scene import Lane, Scene
from envgen_usd.render.trajectories.camera_route import Pace, all_lanes, around, drive
from envgen_usd.render.trajectories.pose_jitter import jittered
from envgen_usd.render.trajectories.spread_poses import is_long, spread
from envgen_usd.render.trajectories.traffic_poses import Ride, rides_along, spread_in_traffic
from envgen_usd.render.trajectories.trajectory_file import FILE_ENDINGS, read_poses
from envgen_usd.seeds import generator

Judge: TypeAlias = Callable[[FloatArray], BoolArray]
"""Tells which camera positions (N x 3) are refused."""
SPREAD, DRIVE, ALL_LANES, TRAFFIC = "spread", "drive", "all-lanes", "traffic"
TRAJECTORIES = (SPREAD, DRIVE, ALL_LANES, TRAFFIC)
"""Names of the option ``--trajectory``, besides files."""
DEFAULT_FRAMES = 20
"""Number of frames of a trajectory without an end."""
_HOPELESS = 200
"""Number of refused places, without any other, after which no place is refused.

A larger value searches longer on stages that surround the camera.
"""
_OWN_EYE = np.zeros((1, 3))
_BLOCK = 4096
"""Number of places judged together; a larger value needs more memory and less time."""


@dataclass(frozen=True)
class Trajectory:
    """Where frames are.

    Attributes:
        name: ``spread``, ``drive``, ``all-lanes``, ``traffic``, or the path of a file of poses.
        spacing: Distance between two frames along a lane, metres.
        fps: Frames a second of a drive; replaces the spacing by ``speed / fps``. With ``traffic``,
            the camera rides along with one vehicle after the other.
        speed: Speed of a drive, metres a second.
        jitter: Random offsets of the poses; `None` for those of single frames only, that is of
            ``spread`` and of ``traffic`` without `fps`.
    """

    name: str = SPREAD
    spacing: float = 10.0
    fps: float | None = None
    speed: float = 10.0
    jitter: bool | None = None

    def check(self) -> None:
        """Checks the values and reads the file.

        Raises:
            EnvgenError: A value or the file cannot be used.
        """
        if self.name not in TRAJECTORIES and not self.given:
            known = ", ".join((*TRAJECTORIES, *(f"a {ending} file" for ending in FILE_ENDINGS)))
            raise EnvgenError(f"render: unknown trajectory {self.name}; known: {known}")
        for name, value in (("speed", self.speed), ("fps", self.fps)):
            if value is not None and not 0.0 < value < np.inf:
                raise EnvgenError(f"render: {name} must be above 0, not {value:g}")
        if not 0.0 < self.pace.spacing < np.inf:
            raise EnvgenError("render: the spacing of frames must be above 0 m")

    @cached_property
    def given(self) -> tuple[Pose, ...]:
        """Poses of the file; empty without a file."""
        return read_poses(Path(self.name)) if self._is_file else ()

    @property
    def _is_file(self) -> bool:
        return Path(self.name).suffix.lower() in FILE_ENDINGS

    @property
    def pace(self) -> Pace:
        """Distance of the stops and speed."""
        return Pace(self.speed / self.fps if self.fps else self.spacing, self.speed)

    def ends(self, scene: Scene) -> bool:
        """True if the trajectory has a last pose on a stage."""
        return bool(self.given) or (self.name == ALL_LANES and bool(scene.lanes))

    @property
    def is_jittered(self) -> bool:
        """True if poses are moved and turned a little."""
        single = self.name == SPREAD or (self.name == TRAFFIC and not self.fps)
        return single if self.jitter is None else self.jitter


@dataclass(frozen=True)
class Places:
    """The poses of a run.

    Attributes:
        poses: Pose of each frame.
        refused: Number of places that were left out.
        issues: What was decided about the places.
    """

    poses: tuple[Pose, ...]
    refused: int = 0
    issues: tuple[Issue, ...] = ()


def trajectory_poses(  # noqa: PLR0913, PLR0917 - what poses follow from
    trajectory: Trajectory,
    scene: Scene,
    camera: Camera,
    frames: int | None,
    seed: int,
    eyes: FloatArray = _OWN_EYE,
    judge: Judge | None = None,
    rides: Sequence[Ride] = (),
) -> Places:
    """Poses of a trajectory; fewer frames are a prefix of more frames.

    Places inside of something or too close to it give way to the next places of the trajectory.
    Those of a file stay, and are counted.

    Args:
        trajectory: Where frames are.
        scene: Stage.
        camera: Camera; gives the height above the lane.
        frames: Largest number of frames; `None` for `DEFAULT_FRAMES`, or for all poses of a
            trajectory that ends.
        seed: Random seed.
        eyes: C x 3, positions of all cameras of the rig in the space of the camera; each of them
            must have its room.
        judge: Tells refused places; `None` if `scene` holds the geometry of the stage.
        rides: Vehicles of the traffic whose places the trajectory ``traffic`` takes.

    Raises:
        EnvgenError: The trajectory is ``traffic``, and no vehicle moves on the stage.
    """
    judge = judge or partial(refused_places, scene)
    if trajectory.given:
        steered = tuple(islice(_steered(trajectory, camera, seed), frames))
        return given_places(judge, steered, eyes)
    limit = frames
    if frames is None and not trajectory.ends(scene):
        limit = DEFAULT_FRAMES
    if trajectory.name == TRAFFIC and not rides:
        raise EnvgenError(
            "render: the trajectory traffic needs vehicles that move, and the stage has none;"
            " add them by `envgen-usd traffic`, or choose another trajectory"
        )
    if not scene.lanes and not rides:
        message = "no lane centre lines on the stage; the camera circles the stage"
        issue = Issue("render.lanes", Severity.WARNING, "/", message)
        return Places(around(scene.bounds, camera, limit or 0), issues=(issue,))
    raw = _steered(trajectory, camera, seed, scene.lanes, rides)
    poses, refused, hopeless = _without_refused(judge, raw, limit, eyes)
    issues = [*_refusal_issues(refused, hopeless=hopeless), *_turn_issues(poses, trajectory)]
    return Places(poses, refused, tuple(issues))


def given_places(judge: Judge, poses: Sequence[Pose], eyes: FloatArray = _OWN_EYE) -> Places:
    """Poses that stay as they are; those that a trajectory would leave out are counted."""
    refused = np.flatnonzero(_refused(judge, poses, eyes))
    if not len(refused):
        return Places(tuple(poses))
    message = f"{len(refused)} given poses lie inside or within {REACH:g} m of an object"
    where = f"frame {refused[0]}"
    action = "the frames are drawn as given"
    issue = Issue("render.places", Severity.WARNING, where, message, action)
    return Places(tuple(poses), len(refused), (issue,))


def _steered(
    trajectory: Trajectory,
    camera: Camera,
    seed: int,
    lanes: Sequence[Lane] = (),
    rides: Sequence[Ride] = (),
) -> Iterator[Pose]:
    """Poses in order, with their random offsets."""
    rng = generator(seed, "render", "file" if trajectory.given else trajectory.name)
    if trajectory.given:
        poses: Iterable[Pose] = trajectory.given
    elif trajectory.name == TRAFFIC and trajectory.fps:
        poses = rides_along(rides, camera, trajectory.fps, rng)
    elif trajectory.name == TRAFFIC:
        poses = spread_in_traffic(rides, camera, rng)
    elif trajectory.name == ALL_LANES:
        poses = all_lanes(lanes, camera, trajectory.pace)
    elif trajectory.name == SPREAD and any(map(is_long, lanes)):
        poses = spread(lanes, camera, rng)
    else:
        poses = drive(lanes, camera, trajectory.pace, rng)
    if not trajectory.is_jittered:
        return iter(poses)
    return jittered(poses, camera.mount, generator(seed, "render", "jitter"))


def _without_refused(
    judge: Judge, raw: Iterator[Pose], limit: int | None, eyes: FloatArray
) -> tuple[tuple[Pose, ...], int, bool]:
    """The first poses that are not refused, the number of refused ones, and whether all were.

    Each place is judged alone, so a longer run only adds poses.
    """
    poses: list[Pose] = []
    refused: list[Pose] = []
    while limit is None or len(poses) < limit:
        missing = _BLOCK if limit is None else limit - len(poses)
        some = tuple(islice(raw, missing if poses else min(missing, _HOPELESS - len(refused))))
        if not some:
            break
        for pose, is_bad in zip(some, _refused(judge, some, eyes).tolist(), strict=True):
            (refused if is_bad else poses).append(pose)
        if not poses and len(refused) == _HOPELESS:
            break
    if poses:
        return tuple(poses), len(refused), False
    return tuple(islice((*refused, *islice(raw, limit)), limit)), 0, True


def _refused(judge: Judge, poses: Sequence[Pose], eyes: FloatArray) -> BoolArray:
    """True for poses of which a camera has no room."""
    places = [eyes @ pose.matrix[:3, :3].T + pose.matrix[:3, 3] for pose in poses]
    all_eyes = np.array(places).reshape(-1, 3)
    refused = judge(all_eyes).reshape(-1, len(eyes))
    return np.asarray(refused.any(axis=1), bool)


def _refusal_issues(refused: int, *, hopeless: bool) -> list[Issue]:
    close = f"inside or within {REACH:g} m of an object"
    if hopeless:
        message, action = f"all places lie {close}", "no place is left out"
        return [Issue("render.places", Severity.WARNING, "/", message, action)]
    if not refused:
        return []
    message = f"{refused} places of the trajectory lie {close}"
    action = "its next places are drawn instead"
    return [Issue("render.places", Severity.INFO, "/", message, action)]


def _turn_issues(poses: Sequence[Pose], trajectory: Trajectory) -> list[Issue]:
    turns = 1 + max(pose.turn for pose in poses)
    if turns == 1:
        return []
    message = f"{len(poses)} frames need {turns} passes over all lanes"
    apart = trajectory.pace.spacing / turns
    action = f"the frames of a place lie about {apart:.2g} m apart"
    return [Issue("render.frames", Severity.INFO, "/", message, action)]
