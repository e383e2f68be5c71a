"""Poses spread over all lanes, so that images share as little as possible."""

from collections.abc import Iterator, Sequence
from itertools import count, islice

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.camera_rig import Camera
from envgen_usd.render.camera_route import Pose, look_at
from envgen_usd.render.render_scene import Lane

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Step between poses as a share of all lanes; every prefix of the sequence is evenly spread."""
_APART = 10.0
"""Least distance of poses in metres while there is room; a larger value spreads them more."""
_TRIES = 20
"""Places that are tried for a pose far from the earlier ones."""
_BASE = 2.7
"""Length of lane in metres over which the heading is taken."""
_ASIDE, _HIGHER = 0.35, 0.15
"""Standard deviations of the position across the lane and of the height, metres."""
_YAW, _PITCH = np.radians(4.0), np.radians(1.2)
"""Standard deviations of the heading and the pitch, radians."""


def spread(
    lanes: Sequence[Lane], camera: Camera, frames: int, rng: np.random.Generator
) -> tuple[Pose, ...]:
    """Poses over all lanes in their direction of travel, with the unsteadiness of a drive.

    Fewer frames are a prefix of more frames.

    Args:
        lanes: Centre lines in the direction of travel.
        camera: Camera; gives the height above the lane.
        frames: Number of poses; without lanes the result is empty.
        rng: Draws the start and the unsteadiness.
    """
    long_enough = [lane for lane in lanes if _length(lane.points) > _BASE]
    return tuple(islice(_poses(long_enough, camera, rng), frames)) if long_enough else ()


def _poses(lanes: Sequence[Lane], camera: Camera, rng: np.random.Generator) -> Iterator[Pose]:
    order = rng.permutation(len(lanes))
    lengths = np.array([_length(lanes[index].points) for index in order])
    ends = np.cumsum(lengths)

    def place_at(mark: float) -> tuple[FloatArray, FloatArray]:
        lane = min(int(np.searchsorted(ends, mark * ends[-1], side="right")), len(order) - 1)
        along = mark * ends[-1] - (ends[lane] - lengths[lane])
        return _at(lanes[order[lane]].points, along)

    mark, taken = float(rng.random()), np.empty((0, 2))
    for number in count():
        best, widest = place_at(mark), -1.0
        for _ in range(_TRIES):
            mark = (mark + _GOLDEN) % 1.0
            place = place_at(mark)
            gap = np.hypot(*(taken - place[0][:2]).T).min(initial=_APART)
            if gap > widest:
                best, widest = place, gap
            if gap >= _APART:
                break
        taken = np.concatenate([taken, best[0][None, :2]])
        yield Pose(_unsteady(*best, camera, rng), number)


def _unsteady(
    here: FloatArray, ahead: FloatArray, camera: Camera, rng: np.random.Generator
) -> FloatArray:
    aside, higher, yaw, pitch = rng.normal(size=4) * (_ASIDE, _HIGHER, _YAW, _PITCH)
    level = np.array([ahead[0], ahead[1], 0.0])
    right = np.cross(level, (0.0, 0.0, 1.0)) / max(float(np.linalg.norm(level)), 1e-9)
    limit = 0.4 * camera.mount
    eye = here + right * np.clip(aside, -1.0, 1.0)
    eye = eye + np.array([0.0, 0.0, camera.mount + float(np.clip(higher, -limit, limit))])
    slope = np.arctan2(ahead[2], np.hypot(ahead[0], ahead[1])) + np.clip(pitch, -0.06, 0.06)
    heading = np.arctan2(ahead[1], ahead[0]) + np.clip(yaw, -0.25, 0.25)
    view = np.array(
        [np.cos(heading) * np.cos(slope), np.sin(heading) * np.cos(slope), np.sin(slope)]
    )
    return look_at(eye, eye + view)


def _at(points: FloatArray, along: float) -> tuple[FloatArray, FloatArray]:
    """Returns the place on a polyline and the direction there."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    s = np.concatenate(([0.0], np.cumsum(steps)))
    at = float(np.clip(along, _BASE / 2, s[-1] - _BASE / 2))
    here, back, front = (
        np.array([np.interp(at + d, s, points[:, axis]) for axis in range(3)])
        for d in (0.0, -_BASE / 2, _BASE / 2)
    )
    return here, front - back


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
