"""Driving lanes on a stage, and the way a car takes along them."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from pxr import Usd, UsdGeom
from scipy.spatial import KDTree

from envgen_usd.models.arrays import FloatArray
from envgen_usd.render.scene import Lane

LANE_ID = "userProperties:lane_id"
SUCCESSORS = "userProperties:successors"
_GAP = 2.0
"""Greatest distance between the ends of lanes that follow one another, metres."""
_ASIDE = 0.5
"""Greatest distance across the direction of travel, where the stage does not say that they do."""
_STRAIGHT_ON = 0.7
"""Least cosine between the directions of lanes that follow one another."""


def read_lane(curves: UsdGeom.Curves, matrix: FloatArray, time: Usd.TimeCode) -> Lane | None:
    """A curve with a ``userProperties:lane_id`` as a lane; none for other curves."""
    prim = curves.GetPrim()
    name = prim.GetAttribute(LANE_ID)
    raw = curves.GetPointsAttr().Get(time)
    if not name or not raw or len(raw) < 2:
        return None
    local = np.array(raw, np.float64)
    points = local @ matrix[:3, :3].T + matrix[:3, 3]
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6
    points = points[np.concatenate(([True], moved))]
    listed = prim.GetAttribute(SUCCESSORS)
    following = listed.Get(time) if listed else None
    if len(points) < 2:
        return None
    return Lane(str(name.Get(time)), points, tuple(str(item) for item in following or ()))


def routes(lanes: Sequence[Lane], rng: np.random.Generator) -> Iterator[FloatArray]:
    """Ways along the lanes, each an N x 3 polyline, until every lane has been driven.

    A way starts on a lane that was not driven yet, drawn by length, and goes on, at forks by the
    draw, until it comes to an end of the road or to a lane that was driven before.
    """
    after = _following(lanes)
    lengths = np.array([_length(lane.points) for lane in lanes])
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
    """Indices of the lanes that can be driven after each lane.

    Lanes are linked by the stage's own successors, and by place and direction, because a chunk's
    border cuts lanes whose successors are named for the whole, and because lanes of a metre or
    two may be missing between two others.
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


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _joined(lines: Sequence[FloatArray]) -> FloatArray:
    """One polyline; a line's first points are left out where they lie behind the line before."""
    points = lines[0]
    for line in lines[1:]:
        beyond = (line - points[-1]) @ (points[-1] - points[-2]) > 0
        points = np.concatenate((points, line[np.argmax(beyond) :] if beyond.any() else line[:0]))
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3
    joined: FloatArray = points[np.concatenate(([True], moved))]
    return joined
