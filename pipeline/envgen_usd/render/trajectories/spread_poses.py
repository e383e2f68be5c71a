"""Poses spread over all lanes, so that images share as little as possible."""

import math
from collections.abc import Iterator, Sequence
from itertools import count, product

import numpy as np

from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.sensor_rig import WHEELBASE
from envgen_usd.render.render_scene import Lane
from envgen_usd.render.trajectories.camera_route import car_at, distances_along, polyline_length

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

    distances = [distances_along(lanes[index].points) for index in order]

    def place_at(mark: float) -> tuple[int, float, float, float]:
        """Lane, distance along it, x and y."""
        lane = min(int(np.searchsorted(ends, mark * ends[-1], side="right")), len(order) - 1)
        along = mark * ends[-1] - (ends[lane] - lengths[lane])
        within = min(max(along, WHEELBASE / 2), lengths[lane] - WHEELBASE / 2)
        points = lanes[order[lane]].points
        x, y = (np.interp(within, distances[lane], points[:, axis]) for axis in (0, 1))
        return lane, within, float(x), float(y)

    mark, taken = float(rng.random()), _Taken()
    for number in count():
        best, widest = place_at(mark), -1.0
        for _ in range(_TRIES):
            mark = (mark + _GOLDEN) % 1.0
            place = place_at(mark)
            gap = taken.gap(*place[2:])
            if gap > widest:
                best, widest = place, gap
            if gap >= _APART:
                break
        taken.add(*best[2:])
        here, ahead = car_at(lanes[order[best[0]]].points, best[1])
        eye = here + np.array([0.0, 0.0, camera.mount])
        yield Pose(look_at(eye, eye + ahead), number)


class _Taken:
    """Places of earlier poses, by squares of `_APART`."""

    def __init__(self) -> None:
        self._squares: dict[tuple[int, int], list[tuple[float, float]]] = {}

    def add(self, x: float, y: float) -> None:
        """Adds a place, metres."""
        self._squares.setdefault((int(x // _APART), int(y // _APART)), []).append((x, y))

    def gap(self, x: float, y: float) -> float:
        """Distance from the nearest place, or `_APART` if that is less."""
        column, row = int(x // _APART), int(y // _APART)
        beside = (
            place
            for square in product(range(column - 1, column + 2), range(row - 1, row + 2))
            for place in self._squares.get(square, ())
        )
        return min([_APART, *(math.hypot(x - a, y - b) for a, b in beside)])


def is_long(lane: Lane) -> bool:
    """True for lanes that a car fits on."""
    return polyline_length(lane.points) > WHEELBASE
