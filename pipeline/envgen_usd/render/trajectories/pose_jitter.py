"""The unsteadiness of a drive: small random offsets of position and heading, drawn by seed."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, on_grid

_ASIDE, _HIGHER = 0.35, 0.15
"""Standard deviations of the position across the lane and of the height, metres."""
_YAW, _PITCH = np.radians(4.0), np.radians(1.2)
"""Standard deviations of the heading and the pitch, radians."""
_MOST_ASIDE, _MOST_YAW, _MOST_PITCH = 1.0, 0.25, 0.06
"""Largest offset across the lane, metres, and largest turns, radians."""
_LARGEST_SHARE = 0.4
"""Largest offset of the height as a share of the camera's height above the lane."""
_MEMORY = 15.0
"""Distance in metres over which the offsets of a route lose 63 % of their correlation.

A larger value makes a drive steadier.
"""


def jittered(poses: Iterable[Pose], mount: float, rng: np.random.Generator) -> Iterator[Pose]:
    """Moves and turns each pose a little; fewer poses are a prefix of more.

    The offsets are normally distributed and bounded. Along a route they change gradually, as an
    Ornstein-Uhlenbeck process of the distance driven; each route starts anew.

    Args:
        poses: Poses with a level horizon.
        mount: Height of the camera above the lane, metres.
        rng: Draws the offsets.
    """
    earlier: Pose | None = None
    state = np.zeros(4)
    for pose in poses:
        kept = _kept(earlier, pose)
        state = kept * state + np.sqrt(1.0 - kept**2) * rng.normal(size=4)
        yield replace(pose, matrix=_moved(pose.matrix, state, mount))
        earlier = pose


def _kept(earlier: Pose | None, pose: Pose) -> float:
    """Correlation of the offsets of two successive poses."""
    if earlier is None or (earlier.route, earlier.turn) != (pose.route, pose.turn):
        return 0.0
    moved = float(np.linalg.norm(pose.matrix[:3, 3] - earlier.matrix[:3, 3]))
    return float(np.exp(-moved / _MEMORY))


def _moved(matrix: FloatArray, state: FloatArray, mount: float) -> FloatArray:
    """Applies offsets, given in standard deviations: aside, up, yaw and pitch."""
    most = np.array([_MOST_ASIDE, _LARGEST_SHARE * abs(mount), _MOST_YAW, _MOST_PITCH])
    aside, higher, yaw, pitch = np.clip(state * (_ASIDE, _HIGHER, _YAW, _PITCH), -most, most)
    right = matrix[:3, 0]
    result = np.eye(4)
    result[:3, :3] = _turn((0.0, 0.0, 1.0), yaw) @ _turn(right, pitch) @ matrix[:3, :3]
    result[:3, 3] = on_grid(matrix[:3, 3] + right * aside + (0.0, 0.0, higher))
    return result


def _turn(axis: FloatArray | tuple[float, float, float], angle: float) -> FloatArray:
    """Rotation by an angle about a unit axis: 3 x 3 (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: FloatArray = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return turn
