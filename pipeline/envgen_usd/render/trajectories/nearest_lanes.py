"""The lane that each frame is on."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.render_scene import Lane

_STEP = 1.0
"""Distance of the places along a lane that are compared, metres; a larger value is less exact."""
_NEAREST = 24
"""Number of places near a camera among which the direction decides."""
_ALONG = 0.7
"""Least cosine between the view and the direction of a lane; a larger value ignores more lanes."""


def nearest_lanes(lanes: Sequence[Lane], poses: Sequence[Pose]) -> list[str]:
    """Returns the id of the lane nearest to each pose, if possible one that the camera follows.

    Args:
        lanes: Centre lines in the direction of travel.
        poses: Poses of a camera.

    Returns:
        An id for each pose; empty on a stage without lanes.
    """
    if not lanes or not poses:
        return [""] * len(poses)
    sampled = [_sampled(lane.points) for lane in lanes]
    places = np.concatenate([each[0] for each in sampled])
    ways = np.concatenate([each[1] for each in sampled])
    owner = np.repeat(np.arange(len(lanes)), [len(each[0]) for each in sampled])
    matrices = np.array([pose.matrix for pose in poses])
    count = min(_NEAREST, len(places))
    _, near = KDTree(places).query(matrices[:, :3, 3], count)
    near = near.reshape(len(poses), count)  # a single neighbour has no axis of its own
    along = np.einsum("nkx,nx->nk", ways[near], matrices[:, :3, 2]) > _ALONG
    chosen = near[np.arange(len(poses)), np.argmax(along, axis=1)]
    return [lanes[index].id for index in owner[chosen].tolist()]


def _sampled(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places along a polyline (N x 3) and the unit directions there, each M x 3."""
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    counts = np.ceil(lengths / _STEP).astype(np.int64)
    segment = np.repeat(np.arange(len(steps)), counts)
    share = (np.arange(len(segment)) - (np.cumsum(counts) - counts)[segment] + 0.5) / counts[
        segment
    ]
    places: FloatArray = points[segment] + share[:, None] * steps[segment]
    return places, (steps / lengths[:, None])[segment]
