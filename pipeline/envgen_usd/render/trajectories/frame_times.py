"""Times of frames on a stage where something moves."""

from collections.abc import Sequence
from dataclasses import replace

from envgen_usd.errors import Issue, Severity
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.seeds import generator

_DIGITS = 6
"""Decimals of a drawn time in seconds: those that ``cameras.json`` records."""


def drawn_times(poses: Sequence[Pose], duration: float, seed: int) -> tuple[Pose, ...]:
    """Poses of which those without a time have one within the range of the stage.

    The time of a frame follows from its number alone, so fewer frames are the first of more.

    Args:
        poses: Pose of each frame.
        duration: Length of the range, seconds.
        seed: Random seed.
    """
    return tuple(
        pose if pose.time is not None else replace(pose, time=_drawn(number, duration, seed))
        for number, pose in enumerate(poses)
    )


def late_issues(poses: Sequence[Pose], duration: float) -> list[Issue]:
    """An issue if frames are later than the range of the stage."""
    late = [number for number, pose in enumerate(poses) if (pose.time or 0.0) > duration + 1e-6]
    if not late:
        return []
    message = f"{len(late)} frames are later than the {duration:g} s in which the stage moves"
    action = "they show what moves where it is last"
    return [Issue("render.time", Severity.WARNING, f"frame {late[0]}", message, action)]


def _drawn(number: int, duration: float, seed: int) -> float:
    share = float(generator(seed, "render", "time", number).random())
    return round(share * duration, _DIGITS)
