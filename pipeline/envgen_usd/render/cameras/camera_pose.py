"""The pose of a camera in a frame, on the grid of camera positions."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray

_GRID = 4096.0
"""Camera positions are multiples of 1 / 4096 m, like mesh vertices, so their differences are exact.

"""


@dataclass(frozen=True)
class Pose:
    """Pose of the camera in a frame.

    Attributes:
        matrix: 4 x 4, from camera space to world space (metres, z up).
        route: Number of the drive; frames of a drive share it.
        turn: Number of earlier passes over all lanes.
        time: Seconds since the start of the route, or of the stage where something moves; `None`
            for poses that are no drive.
        vehicle: Prim of the moving vehicle whose place the camera takes; empty without one.
    """

    matrix: FloatArray
    route: int = 0
    turn: int = 0
    time: float | None = None
    vehicle: str = ""


def look_at(eye: FloatArray, target: FloatArray) -> FloatArray:
    """Matrix (4 x 4) of a camera at `eye` that looks at `target` with a level horizon."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.array([1, 0, 0])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    matrix[:3, 3] = on_grid(eye)
    return matrix


def on_grid(eye: FloatArray) -> FloatArray:
    """Rounds a position to the grid of camera positions."""
    rounded: FloatArray = np.round(eye * _GRID) / _GRID
    return rounded
