"""The surface below an actor: its height, and the pose of wheels on it."""

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.ground import GroundMesh
from envgen_usd.traffic.triangle_heights import TriangleHeights, least_cost

FLOATING = 0.01
"""Largest distance of a wheel from the surface, metres; a larger value keeps more actors at edges.
"""
_AXLE = 0.29
"""Distance of the axles from the middle, as a share of the length."""
_TRACK = 0.42
"""Distance of the wheels from the middle, as a share of the width."""


class StandingSurface:
    """Triangles of a road or of the ground, by place."""

    def __init__(self, corners: FloatArray) -> None:
        """Takes the triangles, T x 3 x 3, metres, road frame."""
        self._triangles = TriangleHeights(corners)

    def heights(self, points: FloatArray) -> FloatArray:
        """Returns the height of the surface at points, N; NaN beside it.

        Where surfaces lie above one another (a bridge), the nearest to the point's z counts.

        Args:
            points: N x 3, metres; z is a guess.
        """
        row, height = self._triangles.at(points)
        return least_cost(row, height, np.abs(height - points[row, 2]), len(points))

    def touches(self, shapes: FloatArray) -> BoolArray:
        """Returns which rectangles (N x 4 x 2) touch the surface, N."""
        return self._triangles.touches(shapes)


def ground_triangles(ground: GroundMesh) -> FloatArray:
    """Returns the faces of a ground mesh as triangles, T x 3 x 3, metres."""
    sizes = ground.face_sizes
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    fans = [
        ground.face_vertices[first[sizes > turn + 2, None] + np.array([0, turn + 1, turn + 2])]
        for turn in range(int(sizes.max(initial=3)) - 2)
    ]
    corners: FloatArray = ground.vertices[np.concatenate(fans)]
    return corners


def wheel_places(places: FloatArray, headings: FloatArray, sizes: FloatArray) -> FloatArray:
    """Returns where wheels stand, N x 4 x 3: front left, front right, rear left, rear right.

    Args:
        places: N x 3, middle of each vehicle, metres; z is handed on.
        headings: N, radians.
        sizes: N x 2, length and width, metres.
    """
    signs = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    reach = signs * (sizes * [_AXLE, _TRACK])[:, None]
    return np.concatenate(
        [
            places[:, None, :2] + turned(reach, headings),
            np.broadcast_to(places[:, None, 2:], (len(places), 4, 1)),
        ],
        axis=2,
    )


def turned(local: FloatArray, headings: FloatArray) -> FloatArray:
    """Returns vectors (N x K x 2) in frames with these headings (N) in the road frame."""
    cos, sin = np.cos(headings)[:, None], np.sin(headings)[:, None]
    x, y = local[..., 0], local[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=2)


def rest(
    heights: FloatArray, sizes: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Lays a rigid vehicle onto the heights of its wheels, by least squares.

    Args:
        heights: N x 4, metres, in the order of `wheel_places`; NaN where there is no surface.
        sizes: N x 2, length and width, metres.

    Returns:
        Height of the middle, pitch and roll (radians, as in `ParkedActor`), and whether each wheel
        touches the surface within `FLOATING`; N each.
    """
    base, track = 2 * _AXLE * sizes[:, 0], 2 * _TRACK * sizes[:, 1]
    front_left, front_right, rear_left, rear_right = heights.T
    pitch = np.arctan2((front_left + front_right - rear_left - rear_right) / 2, base)
    roll = np.arctan2((front_left + rear_left - front_right - rear_right) / 2, track)
    # A plane through four corners of a rectangle misses each by the same distance.
    twist = np.abs(front_left - front_right - rear_left + rear_right) / 4
    return heights.mean(axis=1), pitch, roll, twist <= FLOATING
