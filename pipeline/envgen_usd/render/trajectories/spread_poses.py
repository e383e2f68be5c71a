"""Poses spread over all lanes, so that images share as little as possible."""

from collections.abc import Iterator, Sequence
from itertools import count

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.sensor_rig import WHEELBASE
from envgen_usd.render.render_scene import Lane
from envgen_usd.render.trajectories.camera_route import car_at, polyline_length

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Step between poses as a share of all lanes; every prefix of the sequence is evenly spread."""
_APART = 10.0
"""Least distance of poses in metres while there is room; a larger value spreads them more."""
_TRIES = 20
"""Places that are tried for a pose far from the earlier ones."""


def spread(lanes: Sequence[Lane], camera: Camera, rng: np.random.Generator) -> Iterator[Pose]:
    """Poses over all lanes in their direction of travel, without an end.

    Args:
        lanes: Centre lines in the direction of travel; lanes shorter than a car get no pose.
        camera: Camera; gives the height above the lane.
        rng: Draws the start.
    """
    lanes = [lane for lane in lanes if is_long(lane)]
    if not lanes:
        return
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
        here, ahead = best
        eye = here + np.array([0.0, 0.0, camera.mount])
        yield Pose(look_at(eye, eye + ahead), number)


def is_long(lane: Lane) -> bool:
    """True for lanes that a car fits on."""
    return polyline_length(lane.points) > WHEELBASE
