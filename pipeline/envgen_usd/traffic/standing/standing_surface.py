"""The surface below actors that stand, and where their wheels are."""

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.ground import GroundMesh
from envgen_usd.traffic.triangle_heights import TriangleHeights, least_cost

_AXLE = 0.29
"""Distance of the axles from the middle, as a share of the length."""
_TRACK = 0.42
"""Distance of the wheels from the middle, as a share of the width."""
_CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])


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


def usual_wheels(sizes: FloatArray) -> FloatArray:
    """Returns where vehicles have their wheels, N x 4 x 2, metres ahead and to the left.

    Args:
        sizes: N x 2, length and width, metres.
    """
    wheels: FloatArray = _CORNERS * (sizes * [_AXLE, _TRACK])[:, None]
    return wheels
