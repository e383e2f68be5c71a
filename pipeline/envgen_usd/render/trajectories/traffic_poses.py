"""Poses of a camera that takes the place of vehicles in the traffic of a stage."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Step between poses as a share of all journeys; every prefix of the sequence is evenly spread."""
_APART = 10.0
"""Least distance of poses in metres while there is room; a larger value spreads them more."""
_TRIES = 20
"""Places that are tried for a pose far from the earlier ones."""
_DIGITS = 6
"""Decimals of a time in seconds: those that ``cameras.json`` records."""


@dataclass(frozen=True)
class Ride:
    """A vehicle of the traffic while it is there without a break.

    Attributes:
        path: Its prim.
        start: When it comes, seconds since the start of the stage.
        end: When it goes, seconds.
        at: Gives the middle of its footprint in the frame of the vehicle's heading at a time:
            4 x 4, x ahead, to the world.
    """

    path: str
    start: float
    end: float
    at: Callable[[float], FloatArray]


def spread_in_traffic(
    rides: Sequence[Ride], camera: Camera, rng: np.random.Generator
) -> Iterator[Pose]:
    """Poses over all vehicles and times, without an end.

    Args:
        rides: Vehicles; without any there are no poses.
        camera: Camera; gives the height above the road.
        rng: Draws the start and the order.
    """
    order = rng.permutation(len(rides))
    ends = np.cumsum([max(rides[each].end - rides[each].start, 1e-3) for each in order])

    def stop_at(mark: float) -> tuple[Ride, float]:
        number = min(int(np.searchsorted(ends, mark * ends[-1], side="right")), len(order) - 1)
        ride = rides[order[number]]
        time = ride.end - (ends[number] - mark * ends[-1])
        return ride, round(float(np.clip(time, ride.start, ride.end)), _DIGITS)

    mark, taken = float(rng.random()), np.empty((0, 2))
    for number in count() if rides else ():
        best, widest = stop_at(mark), -1.0
        for _ in range(_TRIES):
            mark = (mark + _GOLDEN) % 1.0
            ride, time = stop_at(mark)
            gap = np.hypot(*(taken - ride.at(time)[:2, 3]).T).min(initial=_APART)
            if gap > widest:
                best, widest = (ride, time), gap
            if gap >= _APART:
                break
        taken = np.concatenate([taken, best[0].at(best[1])[None, :2, 3]])
        yield _riding(*best, camera, number)


def rides_along(
    rides: Sequence[Ride], camera: Camera, fps: float, rng: np.random.Generator
) -> Iterator[Pose]:
    """Poses along one vehicle after the other, each from when it comes until it goes.

    Args:
        rides: Vehicles.
        camera: Camera; gives the height above the road.
        fps: Frames a second.
        rng: Draws the order.
    """
    for number, each in enumerate(rng.permutation(len(rides)).tolist()):
        ride = rides[each]
        times = ride.start + np.arange(int((ride.end - ride.start) * fps + 1e-6) + 1) / fps
        for time in times.round(_DIGITS).tolist():
            yield _riding(ride, time, camera, number)


def _riding(ride: Ride, time: float, camera: Camera, number: int) -> Pose:
    place = ride.at(time)
    eye = place[:3, 3] + np.array([0.0, 0.0, camera.mount])
    return Pose(look_at(eye, eye + place[:3, 0]), number, time=time, vehicle=ride.path)
