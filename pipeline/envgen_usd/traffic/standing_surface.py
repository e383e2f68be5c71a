"""The surface below an actor: its height, and the pose of wheels on it."""

from functools import cached_property

import numpy as np
import shapely

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.ground import GroundMesh

FLOATING = 0.01
"""Largest distance of a wheel from the surface, metres; a larger value keeps more actors at edges.

"""
_AXLE = 0.29
"""Distance of the axles from the middle, as a share of the length."""
_TRACK = 0.42
"""Distance of the wheels from the middle, as a share of the width."""
_LEAST_AREA = 1e-6
"""Least double area in plan of a triangle, m²; kerb faces are vertical."""


class StandingSurface:
    """Triangles of a road or of the ground, by place."""

    def __init__(self, corners: FloatArray) -> None:
        """Takes the triangles, T x 3 x 3, metres, road frame."""
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        self._corners = corners[np.abs(area) > _LEAST_AREA]

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(shapely.polygons(self._corners[:, :, :2]))

    def heights(self, points: FloatArray) -> FloatArray:
        """Returns the height of the surface at points, N; NaN beside it.

        Where surfaces lie above one another (a bridge), the nearest to the point's z counts.

        Args:
            points: N x 3, metres; z is a guess.
        """
        found = np.full(len(points), np.nan)
        row, triangle = self._tree.query(shapely.points(points[:, :2]), predicate="intersects")
        if not len(row):
            return found
        origin, first, second = self._corners[triangle].swapaxes(0, 1)
        across, along, to = first - origin, second - origin, points[row] - origin
        area = across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]
        u = (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / area
        v = (across[:, 0] * to[:, 1] - across[:, 1] * to[:, 0]) / area
        height = origin[:, 2] + u * across[:, 2] + v * along[:, 2]
        order = np.argsort(-np.abs(height - points[row, 2]), kind="stable")
        found[row[order]] = height[order]
        return found

    def touches(self, shapes: FloatArray) -> BoolArray:
        """Returns which rectangles (N x 4 x 2) touch the surface, N."""
        hit = np.zeros(len(shapes), dtype=bool)
        hit[self._tree.query(shapely.polygons(shapes), predicate="intersects")[0]] = True
        return hit


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
