"""Poses spread over all lanes, so that images share as little as possible."""

from collections.abc import Iterator, Sequence
from itertools import count, islice

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.camera_rig import Camera
from envgen_usd.render.camera_route import WHEELBASE, Pose, car_at, look_at, polyline_length
from envgen_usd.render.render_scene import Lane

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Step between poses as a share of all lanes; every prefix of the sequence is evenly spread."""
_APART = 10.0
"""Least distance of poses in metres while there is room; a larger value spreads them more."""
_TRIES = 20
"""Places that are tried for a pose far from the earlier ones."""
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
    long_enough = [lane for lane in lanes if polyline_length(lane.points) > WHEELBASE]
    return tuple(islice(_poses(long_enough, camera, rng), frames)) if long_enough else ()


def _poses(lanes: Sequence[Lane], camera: Camera, rng: np.random.Generator) -> Iterator[Pose]:
    order = rng.permutation(len(lanes))
    lengths = np.array([polyline_length(lanes[index].points) for index in order])
    ends = np.cumsum(lengths)

    def place_at(mark: float) -> tuple[FloatArray, FloatArray]:
        lane = min(int(np.searchsorted(ends, mark * ends[-1], side="right")), len(order) - 1)
        along = mark * ends[-1] - (ends[lane] - lengths[lane])
        within = np.clip(along, WHEELBASE / 2, lengths[lane] - WHEELBASE / 2)
        return car_at(lanes[order[lane]].points, float(within))

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
