"""The route of the camera: paths along the lanes, and poses along a path."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
from scipy.spatial import KDTree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.sensor_rig import WHEELBASE
from envgen_usd.render.render_scene import Lane

_GAP = 2.0
"""Largest gap between the ends of consecutive lanes, metres; a larger value bridges wider gaps.

"""
_ASIDE = 0.5
"""Largest lateral offset of consecutive lanes without a link on the stage, metres.

A larger value joins more lanes.
"""
_STRAIGHT_ON = 0.7
"""Least cosine between the directions of consecutive lanes; a larger value forbids sharper turns.

"""
_END_MARGIN = 15.0
"""Least distance to the end of a route, metres; a larger value ends drives earlier."""


@dataclass(frozen=True)
class Pace:
    """Stops of a drive.

    Attributes:
        spacing: Distance between two poses, metres.
        speed: Speed of the drive, metres a second; gives the poses their times.
    """

    spacing: float
    speed: float


def drive(
    lanes: Sequence[Lane], camera: Camera, pace: Pace, rng: np.random.Generator
) -> Iterator[Pose]:
    """Poses of a camera that drives along the lanes, without an end.

    After all lanes, another pass follows on other routes. Its stops halve the gaps between the
    earlier stops, so no image repeats.

    Args:
        lanes: Centre lines in the direction of travel; without lanes there are no poses.
        camera: Camera; gives the height above the lane.
        pace: Distance of the poses, and speed.
        rng: Draws the start and the turns.
    """
    numbers = count()
    for turn in count() if lanes else ():
        for way in routes(lanes, rng):
            length = polyline_length(way)
            first, last = WHEELBASE / 2, max(length - _END_MARGIN, length / 2)
            first += _halving(turn) * min(pace.spacing, max(last - first, 0.0))
            stops = np.arange(first, max(last, first + 1e-6), pace.spacing)
            number = next(numbers)
            for matrix, time in _stops(way, stops, camera, pace.speed):
                yield Pose(matrix, number, turn, time)


def all_lanes(lanes: Sequence[Lane], camera: Camera, pace: Pace) -> Iterator[Pose]:
    """Poses along every lane in its direction of travel; lanes follow one another by name.

    A lane shorter than the wheelbase gets a single pose in its middle.
    """
    for number, lane in enumerate(sorted(lanes, key=_by_name)):
        length = polyline_length(lane.points)
        stops = np.arange(WHEELBASE / 2, length - WHEELBASE / 2 + 1e-6, pace.spacing)
        stops = stops if len(stops) else np.array([length / 2])
        for matrix, time in _stops(lane.points, stops, camera, pace.speed):
            yield Pose(matrix, number, time=time)


def _by_name(lane: Lane) -> list[tuple[str, int]]:
    """Sorts numbers within names by their value."""
    return [(text, int(digits or 0)) for text, digits in re.findall(r"(\D+|^)(\d*)", lane.id)]


def _halving(number: int) -> float:
    """0, 1/2, 1/4, 3/4, 1/8, ...: the sequence of van der Corput."""
    return sum(int(digit) * 0.5**place for place, digit in enumerate(f"{number:b}"[::-1], 1))


def around(bounds: FloatArray, camera: Camera, frames: int) -> tuple[Pose, ...]:
    """Poses on a circle around a stage without lanes, directed at its centre."""
    middle, size = bounds.mean(axis=0), bounds[1] - bounds[0]
    reach = 0.75 * float(np.hypot(size[0], size[1])) + 2.0 * camera.near
    angles = 2.0 * np.pi * np.arange(frames) / max(frames, 1)
    ring = np.stack((np.cos(angles), np.sin(angles), np.full(frames, 0.5)), axis=1)
    eyes = middle + ring * (reach, reach, reach)
    return tuple(Pose(look_at(eye, middle)) for eye in eyes)


def _stops(
    way: FloatArray, stops: FloatArray, camera: Camera, speed: float
) -> Iterator[tuple[FloatArray, float]]:
    """Matrices and times at distances along a path; the time runs from its first place."""
    for at in stops.tolist():
        here, ahead = car_at(way, at)
        eye = here + np.array([0.0, 0.0, camera.mount])
        yield look_at(eye, eye + ahead), max(at - WHEELBASE / 2, 0.0) / speed


def car_at(way: FloatArray, along: float) -> tuple[FloatArray, FloatArray]:
    """Returns the middle of a car on a path (N x 3), and the vector between its axles."""
    s = distances_along(way)
    here, back, front = (
        np.array([np.interp(along + d, s, way[:, axis]) for axis in range(3)])
        for d in (0.0, -WHEELBASE / 2, WHEELBASE / 2)
    )
    return here, front - back


def distances_along(way: FloatArray) -> FloatArray:
    """Returns the distance of each point of a path (N x 3) from its first one, metres."""
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    return np.concatenate(([0.0], np.cumsum(steps)))


def polyline_length(points: FloatArray) -> float:
    """Returns the length of a polyline (N x 3)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def routes(lanes: Sequence[Lane], rng: np.random.Generator) -> Iterator[FloatArray]:
    """Routes along the lanes, each an N x 3 polyline, that together cover every lane.

    A route starts on an unvisited lane, drawn by length. Forks are drawn at random. The route ends
    at the end of the road or at a visited lane.
    """
    after = _following(lanes)
    lengths = np.array([polyline_length(lane.points) for lane in lanes])
    left = np.ones(len(lanes), bool)
    while left.any():
        weights = np.where(left, lengths, 0.0)
        at = int(rng.choice(len(lanes), p=weights / weights.sum()))
        way = [at]
        left[at] = False
        while fresh := [other for other in after[at] if left[other]]:
            at = fresh[int(rng.integers(len(fresh)))]
            left[at] = False
            way.append(at)
        yield _joined([lanes[index].points for index in way])


def _following(lanes: Sequence[Lane]) -> Mapping[int, list[int]]:
    """Indices of the successors of each lane.

    Lanes connect by the stage's successors, and by position and direction. Chunk borders cut lanes
    whose successors refer to the whole lane, and very short lanes may be missing.
    """
    heads = np.array([lane.points[0] for lane in lanes])
    tree = KDTree(heads)
    return {
        index: sorted(
            other
            for other in tree.query_ball_point(lane.points[-1], _GAP)
            if other != index and _follows(lane, lanes[other])
        )
        for index, lane in enumerate(lanes)
    }


def _follows(lane: Lane, other: Lane) -> bool:
    ending = lane.points[-1] - lane.points[-2]
    ahead = ending / max(float(np.linalg.norm(ending)), 1e-12)
    start = other.points[1] - other.points[0]
    gap = other.points[0] - lane.points[-1]
    if gap @ ahead < -_ASIDE:
        return False
    aside = float(np.linalg.norm(gap - (gap @ ahead) * ahead))
    cosine = float(ahead @ start) / max(float(np.linalg.norm(start)), 1e-12)
    return cosine > _STRAIGHT_ON and (aside < _ASIDE or other.id in lane.successors)


def _joined(lines: Sequence[FloatArray]) -> FloatArray:
    """A single polyline; leading points of a line that lie behind the previous line are dropped."""
    points = lines[0]
    for line in lines[1:]:
        beyond = (line - points[-1]) @ (points[-1] - points[-2]) > 0
        points = np.concatenate((points, line[np.argmax(beyond) :] if beyond.any() else line[:0]))
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3
    joined: FloatArray = points[np.concatenate(([True], moved))]
    return joined
