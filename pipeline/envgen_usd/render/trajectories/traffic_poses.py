"""Poses of a camera that takes the place of vehicles in the traffic of a stage."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Step between poses as a share of all ways; every prefix of the sequence is evenly spread."""
_APART = 10.0
"""Least distance of poses in metres while there is room; a larger value spreads them more."""
_TRIES = 20
"""Places that are tried for a pose far from the earlier ones."""
_REST = 0.5
"""Metres that a second adds to a way; a larger value draws more frames of vehicles that stand."""
_STEP = 0.25
"""Seconds between the places that measure a way."""
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
    """Poses over the ways of all vehicles, without an end.

    Each metre of a way has the same share of the poses, not each second: else most would stand
    in queues, close behind somebody.

    Args:
        rides: Vehicles; without any there are no poses.
        camera: Camera; gives the height above the road.
        rng: Draws the start and the order.
    """
    order = rng.permutation(len(rides))
    ways = [_way(rides[each]) for each in order]
    ends = np.cumsum([lengths[-1] for _, lengths in ways])

    def stop_at(mark: float) -> tuple[Ride, float]:
        number = min(int(np.searchsorted(ends, mark * ends[-1], side="right")), len(order) - 1)
        times, lengths = ways[number]
        time = np.interp(mark * ends[-1] - (ends[number] - lengths[-1]), lengths, times)
        return rides[order[number]], round(float(time), _DIGITS)

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


def _way(ride: Ride) -> tuple[FloatArray, FloatArray]:
    """Times of a ride, and its length until each of them, metres; rests add to it."""
    steps = max(int(np.ceil((ride.end - ride.start) / _STEP)), 1)
    times = np.linspace(ride.start, ride.end, steps + 1)
    places = np.array([ride.at(time)[:2, 3] for time in times.tolist()])
    moved = np.hypot(*np.diff(places, axis=0).T) + _REST * np.diff(times).clip(1e-3)
    return times, np.concatenate(([0.0], np.cumsum(moved)))


def _riding(ride: Ride, time: float, camera: Camera, number: int) -> Pose:
    place = ride.at(time)
    eye = place[:3, 3] + np.array([0.0, 0.0, camera.mount])
    return Pose(look_at(eye, eye + place[:3, 0]), number, time=time, vehicle=ride.path)
